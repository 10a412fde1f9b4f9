"""Points in space from two cameras."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.features.stereo_points import StereoPoints
from robsim.kernels.features.midpoint_triangulation import triangulate_midpoint
from robsim.testing import check_feature

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def pair(seed, marks=6, runs=8):
    """Points X (runs, marks, 3), both their images, and poses of the second camera."""
    rng = np.random.default_rng(seed)
    X = rng.uniform([-0.5, -0.5, 1.0], [0.5, 0.5, 2.0], (runs, marks, 3))
    twist = rng.uniform([0.2, -0.2, -0.2, -0.2, -0.4, -0.2], [0.6, *[0.2] * 3, 0.0, 0.2], (runs, 6))
    B = rs.Pose.exp(twist)
    return X, flat(X), flat(B.inv() @ X), B


def flat(X):
    return X[..., :2] / X[..., 2:]


def last(array):
    return np.ascontiguousarray(np.moveaxis(array, 0, -1))


def triangulated(x, other, B):
    X = np.empty((x.shape[1], 3, x.shape[0]))
    triangulate_midpoint(last(x), last(other), last(B.matrix[:, :3]), X)
    return np.moveaxis(X, -1, 0)


@steady
@given(seed=seeds)
def test_exact_images_give_the_points_back(seed):
    X, x, other, B = pair(seed)
    close(triangulated(x, other, B), X, 3e-14)


@steady
@given(seed=seeds)
def test_rays_that_miss_each_other_meet_in_the_middle(seed):
    """Against the least-squares solution of l d = t + m e, for the lengths l and m."""
    X, x, other, B = pair(seed)
    rng = np.random.default_rng(seed)
    x, other = (y + rng.normal(scale=3e-3, size=y.shape) for y in (x, other))
    found = triangulated(x, other, B)
    for b in range(len(X)):
        R, t = B.rotation[b], B.position[b]
        for n in range(X.shape[1]):
            d, e = np.array([*x[b, n], 1.0]), R @ [*other[b, n], 1.0]
            l, m = np.linalg.lstsq(np.column_stack([d, -e]), t, rcond=None)[0]
            close(found[b, n], (l * d + t + m * e) / 2, 1e-12)
    assert np.abs(found - X).max() > 1e-3  # the noise matters


@steady
@given(seed=seeds)
def test_either_camera_may_be_the_first(seed):
    _, x, other, B = pair(seed)
    other = other + 2e-3
    close(B @ triangulated(other, x, B.inv()), triangulated(x, other, B), 1e-12)


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_parallel_rays_meet_nowhere(turn):
    B = rs.Pose(rs.Pose.at(0.2, 0, 0, rpy=(0, turn, 0)).matrix[None])
    x = np.array([[[0.1, -0.05], [0.0, 0.0]]])
    rays = np.concatenate([x, np.ones((1, 2, 1))], axis=-1)
    same = flat(rays @ B.rotation[0])
    assert not np.isfinite(triangulated(x, same, B)).any()
    x[..., 0] += 1e-6
    nearly = triangulated(x, same, B)  # meet 200 km away
    assert (nearly[..., 2] > 1e5).all()


def test_two_cameras_in_one_place_see_no_depth():
    _, x, _, _ = pair(3)
    here = rs.Pose.exp(np.zeros((len(x), 6)))
    assert not np.isfinite(triangulated(x, x, here)).any()


@steady
@given(seed=seeds)
def test_the_interaction_matrix_is_the_derivative(seed):
    assert check_feature(StereoPoints(), seed=seed, runs=50, bits=True) == []


def test_a_static_point_moves_against_the_camera():
    """Xdot = -v - omega x X."""
    X, x, other, B = pair(4)
    camera = rs.Camera(np.eye(3))
    second = rs.features.Observation.of(other, X[..., 2], camera)
    seen = rs.features.Observation.of(x, X[..., 2], camera, other=second, between=B)
    close(StereoPoints().measure(seen), X.reshape(len(X), -1), 3e-14)
    v, omega = np.array([0.1, -0.2, 0.3]), np.array([0.3, 0.2, -0.5])
    rate = StereoPoints().interaction(seen) @ [*v, *omega]
    close(rate, (-v - np.cross(omega, X)).reshape(len(X), -1), 3e-14)
