"""The images of circles and spheres, against their projection by other methods."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.base.errors import InputError
from robsim.features.ellipse import Ellipse
from robsim.features.moments import RegionMoments
from robsim.features.sphere import Sphere
from robsim.testing import check_feature

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)
UNEVEN = np.array([0.0, 1.2, 2.1, 3.7, 5.0])


def round_marks(angles, a=0.2, b=0.2):
    """(N, 3) marks at these angles on an ellipse in the plane z = 0 of the target."""
    return np.stack([a * np.cos(angles), b * np.sin(angles), 0 * angles], axis=1)


def observe(x, depth=None):
    """Return the observation of normalised points (N, 2) in one run."""
    depth = np.ones(len(x)) if depth is None else depth
    camera = rs.Camera(np.eye(3))
    return rs.features.Observation.of(x, depth, camera)


def seen_from(T_c_o, marks):
    X = T_c_o @ marks
    return observe(X[:, :2] / X[:, 2:], X[:, 2])


def random_view(seed):
    rng = np.random.default_rng(seed)
    return rs.Pose.at(*rng.uniform([-0.3, -0.3, 0.6], [0.3, 0.3, 1.5]), rpy=rng.uniform(-1, 1, 3))


# circles


@pytest.mark.parametrize("n", [5, 8])
@steady
@given(seed=seeds)
def test_the_interaction_matrix_of_an_ellipse_is_its_derivative(n, seed):
    angles = UNEVEN if n == 5 else np.arange(8) * np.pi / 4
    assert check_feature(Ellipse(), marks=round_marks(angles), seed=seed, runs=50, bits=True) == []


@steady
@given(seed=seeds, a=st.floats(0.05, 0.3), b=st.floats(0.05, 0.3))
def test_the_image_of_an_ellipse_in_space_agrees_with_its_dual_conic(seed, a, b):
    """H diag(a^2, b^2, -1) H' is the dual of the image, H = (r1 r2 t): centre and n without a fit.

    The dual of (z - c)' M^-1 (z - c) = 1 is proportional to (M - c c', -c; -c', -1), and n = M / 4.
    """
    T = random_view(seed)
    H = T.matrix[:3, [0, 1, 3]]
    dual = H @ np.diag([a * a, b * b, -1]) @ H.T
    dual /= -dual[2, 2]
    centre = -dual[:2, 2]
    n = (dual[:2, :2] + np.outer(centre, centre)) / 4
    s = Ellipse().measure(seen_from(T, round_marks(UNEVEN, a, b)))[0]
    expected = [*centre, n[0, 0], n[0, 1], n[1, 1]]
    np.testing.assert_allclose(s, expected, rtol=0, atol=1e-11)


def test_an_ellipse_is_the_region_of_a_polygon_with_many_corners():
    """Corners on the ellipse miss its area by 2 pi^2 / (3 N^2) of it."""
    N = 4000
    view = seen_from(random_view(7), round_marks(np.arange(N) * 2 * np.pi / N, 0.2, 0.1))
    s, t = Ellipse().measure(view)[0], RegionMoments().measure(view)[0]
    np.testing.assert_allclose(s[:2], t[1:3], rtol=0, atol=1e-7)
    alpha = 0.5 * np.arctan2(2 * s[3], s[2] - s[4])
    area = 4 * np.pi * np.sqrt(s[2] * s[4] - s[3] ** 2)
    np.testing.assert_allclose([area, alpha], [t[0], t[3]], rtol=2e-6)
    L, M = Ellipse().interaction(view)[0], RegionMoments().interaction(view)[0]
    np.testing.assert_allclose(L[:2], M[1:3], rtol=0, atol=1e-6)


def test_more_marks_than_five_are_fitted():
    """Noise averages out: the centre from 200 marks is nearer than from 5."""
    rng, T = np.random.default_rng(3), random_view(3)
    exact = Ellipse().measure(seen_from(T, round_marks(UNEVEN)))[0]
    errors = {}
    for n in (5, 200):
        view = seen_from(T, round_marks(np.arange(n) * 2 * np.pi / n))
        noisy = [observe(view.points[0] + 1e-4 * rng.normal(size=(n, 2))) for _ in range(30)]
        errors[n] = np.std([Ellipse().measure(v)[0] - exact for v in noisy], axis=0)
    assert (errors[200] < 0.35 * errors[5]).all()


def test_a_circle_fixes_no_more_than_five_motions():
    L = Ellipse().interaction(seen_from(random_view(5), round_marks(UNEVEN)))[0]
    singular = np.linalg.svd(L, compute_uv=False)
    assert L.shape == (5, 6) and singular[-1] > 1e-3


@pytest.mark.parametrize(
    "points",
    [
        [[t, 0.1 / t] for t in (0.1, 0.3, 0.7, -0.2, -0.5)],  # a hyperbola
        [[0.1 * t, 0.2 * t + 0.1] for t in range(5)],  # a line
        [[0, 0], [1, 0], [1, 1], [0, 1], [0, 1]],  # four points
        [[0.3, 0.3]] * 5,
    ],
    ids=["hyperbola", "line", "four", "one"],
)
def test_where_there_is_no_ellipse_there_is_no_number(points):
    assert np.isnan(Ellipse().measure(observe(points))).all()


# spheres


@steady
@given(seed=seeds, radius=st.floats(0.02, 0.5))
def test_the_interaction_matrix_of_a_sphere_is_its_derivative(seed, radius):
    assert check_feature(Sphere(radius), marks=1, seed=seed, runs=50, bits=True) == []


@steady
@given(seed=seeds, radius=st.floats(0.02, 0.4))
def test_a_sphere_agrees_with_its_outline(seed, radius):
    """The unit vectors u along tangent rays have w . u = 1 for w = s / sqrt(|s|^2 - 1)."""
    rng = np.random.default_rng(seed)
    X = rng.uniform([-0.4, -0.4, 0.8], [0.4, 0.4, 2.0])
    across = np.linalg.svd(X[None])[2][1:]  # two unit vectors at right angles to X
    far, t = np.linalg.norm(X), np.arange(9) * 2 * np.pi / 9
    sine = radius / far
    outward = np.cos(t)[:, None] * across[0] + np.sin(t)[:, None] * across[1]
    normal = np.sqrt(1 - sine**2) * outward - sine * X / far
    touch = X + radius * normal  # where tangent rays touch the sphere
    np.testing.assert_allclose(np.einsum("ij,ij->i", touch, touch - X), 0, atol=1e-14)
    u = np.append(touch[:, :2] / touch[:, 2:], np.ones((9, 1)), axis=1)  # their image
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    w = np.linalg.lstsq(u, np.ones(9), rcond=None)[0]
    s = Sphere(radius).measure(observe([X[:2] / X[2]], [X[2]]))[0]
    np.testing.assert_allclose(w / np.sqrt(w @ w - 1), s, rtol=1e-9, atol=1e-9)


def test_the_interaction_matrix_of_a_sphere_is_a_cross_product():
    view = observe([[0.1, -0.2]], [1.5])
    s, L = Sphere(0.25).measure(view)[0], Sphere(0.25).interaction(view)[0]
    v, w = np.array([0.1, 0.2, -0.3]), np.array([0.4, -0.5, 0.6])
    np.testing.assert_allclose(L @ [*v, *w], -v / 0.25 + np.cross(s, w), rtol=0, atol=1e-15)


@pytest.mark.parametrize("radius", [0, -1, np.nan, "big", [1, 2]])
def test_a_radius_is_a_positive_number(radius):
    with pytest.raises(InputError, match=r"Sphere\.radius"):
        Sphere(radius)
