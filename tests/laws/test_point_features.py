"""Features of single marks: L is the derivative of s, and angles stay near the goal's angles."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.features.depth import LogDepth
from robsim.features.points_3d import Points3D
from robsim.features.polar import Polar
from robsim.features.spherical import Spherical
from robsim.testing import check_feature

steady = settings(derandomize=True, max_examples=25, deadline=None)
seeds = st.integers(0, 2**31)
angles = st.floats(-np.pi, np.pi)
EACH = pytest.mark.parametrize(
    "feature", [Polar(), Spherical(), LogDepth(), Points3D()], ids=lambda f: type(f).__name__
)
PINHOLE = rs.Camera(np.eye(3))
# away from the principal point, where polar coordinates are not smooth, in all the views below
MARKS = np.array([[0.7, 0.5, 0], [-0.6, 0.6, 0.1], [-0.5, -0.7, 0], [0.6, -0.6, -0.1]])


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def observe(X):
    """The image of points (runs, marks, 3) in axes of a camera with K = I."""
    X = np.asarray(X, float)
    return rs.features.Observation.of(X[..., :2] / X[..., 2:], X[..., 2], PINHOLE)


def at_angle(*theta, rho=0.4, Z=1.5):
    """One mark per run, at polar coordinates (rho, theta) in the image."""
    return observe([[[Z * rho * np.cos(t), Z * rho * np.sin(t), Z]] for t in theta])


def scattered(seed, runs=1, marks=4):
    return np.random.default_rng(seed).uniform([-0.5, -0.5, 1], [0.5, 0.5, 2], (runs, marks, 3))


@EACH
@steady
@given(seed=seeds)
@pytest.mark.few(1)
def test_the_interaction_matrix_is_the_derivative_in_50_views_each(feature, seed):
    assert check_feature(feature, MARKS, seed, runs=50, bits=True) == []


@EACH
@steady
@given(seed=seeds, number=st.integers(1, 6))
def test_each_run_has_the_bits_that_it_has_alone(feature, seed, number):
    X = scattered(seed, number)
    s, L = feature.measure(observe(X)), feature.interaction(observe(X))
    for b in range(number):
        np.testing.assert_array_equal(feature.measure(observe(X[b : b + 1]))[0], s[b])
        np.testing.assert_array_equal(feature.interaction(observe(X[b : b + 1]))[0], L[b])


# closed forms


@steady
@given(seed=seeds)
def test_polar_has_the_published_interaction_matrix(seed):
    x, y, Z = scattered(seed, marks=1)[0, 0]
    rho, theta = np.hypot(x / Z, y / Z), np.arctan2(y, x)
    c, s = np.cos(theta), np.sin(theta)
    radial = [-c / Z, -s / Z, rho / Z, (1 + rho**2) * s, -(1 + rho**2) * c, 0]
    around = [s / (rho * Z), -c / (rho * Z), 0, c / rho, s / rho, -1]
    L = Polar().interaction(observe([[[x, y, Z]]]))[0]
    close(L[0], radial, 1e-14 * 4)
    close(L[1], around, 1e-14 * 4 / rho)


@steady
@given(seed=seeds)
def test_bearings_are_unit_vectors_and_move_on_the_sphere(seed):
    X = scattered(seed, marks=3)
    s, L = Spherical().measure(observe(X))[0], Spherical().interaction(observe(X))[0]
    close(s, (X / np.linalg.norm(X, axis=-1, keepdims=True)).ravel(), 1e-15)
    for unit, rate in zip(s.reshape(3, 3), L.reshape(3, 3, 6), strict=True):
        close(unit @ rate, np.zeros(6), 1e-15)
        close(rate[:, 3:] @ [1, 2, 3], np.cross(unit, [1, 2, 3]), 1e-15)


@steady
@given(seed=seeds)
def test_bearings_are_points_in_space_over_their_distance(seed):
    """s = X/|X| gives sdot = (I - s s') Xdot / |X|: an L derived from the L of points in space."""
    X = scattered(seed, marks=1)
    s, distance = X[0, 0] / np.linalg.norm(X), np.linalg.norm(X)
    across = (np.eye(3) - np.outer(s, s)) / distance
    close(
        Spherical().interaction(observe(X))[0],
        across @ Points3D().interaction(observe(X))[0],
        1e-14,
    )


@steady
@given(seed=seeds)
def test_points_in_space_move_as_static_points_do(seed):
    X, twist = scattered(seed, marks=2), np.random.default_rng(seed).normal(size=6)
    close(Points3D().measure(observe(X))[0], X.ravel(), 1e-15)
    rate = (Points3D().interaction(observe(X))[0] @ twist).reshape(2, 3)
    close(rate, -twist[:3] - np.cross(twist[3:], X[0]), 1e-14)


@steady
@given(seed=seeds)
def test_log_depth_has_the_third_row_of_the_points_in_space(seed):
    X = scattered(seed, marks=2)
    rows = Points3D().interaction(observe(X))[0, 2::3] / X[0, :, 2:]
    close(LogDepth().interaction(observe(X))[0], rows, 1e-15)


# symmetries


@steady
@given(theta=angles, turn=angles)
def test_a_turn_about_the_optical_axis_moves_theta_alone_and_by_as_much(theta, turn):
    here = at_angle(theta)
    polar = Polar().towards(here)
    rho, angle = polar.measure(at_angle(theta - turn))[0] - polar.measure(here)[0]
    close(rho, 0, 1e-15)
    close(np.exp(1j * angle), np.exp(-1j * turn), 1e-14)
    close(Polar().interaction(here)[0, :, 5], [0, -1], 1e-15)


@EACH
@steady
@given(seed=seeds, k=st.floats(0.1, 10))
def test_a_larger_world_divides_only_the_translational_columns(feature, seed, k):
    X = scattered(seed)
    s, L = feature.measure(observe(X)), feature.interaction(observe(X))
    scaled = {Points3D: k * s, LogDepth: s + np.log(k)}.get(type(feature), s)
    close(feature.measure(observe(k * X)), scaled, 1e-13)
    if isinstance(feature, Points3D):  # in metres, so here it multiplies the rotational ones
        close(feature.interaction(observe(k * X)) / [1, 1, 1, k, k, k], L, 1e-13)
    else:
        close(feature.interaction(observe(k * X)) * [k, k, k, 1, 1, 1], L, 1e-11)


# towards a goal


@steady
@given(theta=angles, goal=angles)
def test_theta_is_the_one_within_half_a_turn_of_the_goal(theta, goal):
    polar = Polar().towards(at_angle(goal))
    s, s_goal = polar.measure(at_angle(theta))[0], polar.measure(at_angle(goal))[0]
    assert abs(s[1] - s_goal[1]) <= np.pi + 1e-15  # but for rounding
    close(np.exp(1j * s[1]), np.exp(1j * theta), 1e-15)
    np.testing.assert_array_equal(s_goal, Polar().measure(at_angle(goal))[0])


def test_across_half_a_turn_the_error_is_the_short_way_round():
    polar = Polar().towards(at_angle(3.1))
    s, s_goal = (polar.measure(at_angle(theta))[0] for theta in (-3.1, 3.1))
    close(s - s_goal, [0, 2 * np.pi - 6.2], 1e-14)
    polar = Polar().towards(at_angle(-3.1))
    s, s_goal = (polar.measure(at_angle(theta))[0] for theta in (3.1, -3.1))
    close(s - s_goal, [0, 6.2 - 2 * np.pi], 1e-14)


def test_exactly_half_a_turn_counts_as_plus_pi():
    left, right = observe([[[-0.4, 0.0, 1.0]]]), observe([[[0.4, 0.0, 1.0]]])
    for goal, there in ((left, right), (right, left)):
        polar = Polar().towards(goal)
        assert (polar.measure(there) - polar.measure(goal))[0, 1] == np.pi


def test_log_depth_is_relative_to_the_goal_and_zero_there():
    X = scattered(3)
    feature = LogDepth().towards(observe(X))
    np.testing.assert_array_equal(feature.measure(observe(X)), np.zeros((1, 4)))
    close(feature.measure(observe(2 * X)), np.full((1, 4), np.log(2)), 1e-15)
    np.testing.assert_array_equal(
        feature.interaction(observe(X)), LogDepth().interaction(observe(X))
    )


@pytest.mark.parametrize("kind", [Polar, LogDepth], ids=lambda f: type(f).__name__)
def test_a_feature_towards_a_goal_is_a_value(kind):
    here, there, elsewhere = (kind().towards(observe(scattered(i))) for i in (1, 1, 2))
    assert here == there == pickle.loads(pickle.dumps(here))
    assert hash(here) == hash(there)
    assert here not in (elsewhere, kind(), replace(here, tolerance=1e-3))


# features that do not exist


def test_a_mark_at_the_principal_point_has_no_finite_polar_interaction_matrix():
    X = [[[0.0, 0.0, 1.0], [0.3, 0.1, 1.0]]]
    s, L = Polar().measure(observe(X))[0], Polar().interaction(observe(X))[0]
    np.testing.assert_array_equal(s[:2], [0, 0])
    assert np.isnan(L[:2]).all()
    assert np.isfinite(L[2:]).all()


def test_a_depth_of_zero_or_less_has_no_finite_logarithm():
    behind = rs.features.Observation.of(np.zeros((2, 2)), [0.0, -1.0], PINHOLE)
    assert not np.isfinite(LogDepth().measure(behind)).any()


@EACH
def test_marks_without_an_image_are_not_finite(feature):
    lost = rs.features.Observation.of(np.full((2, 2), np.nan), np.full(2, np.nan), PINHOLE)
    assert not np.isfinite(feature.measure(lost)).any()


def test_units_tolerances_and_the_needs_of_each():
    for feature, unit in ((Polar, "1"), (Spherical, "1"), (LogDepth, "1"), (Points3D, "m")):
        assert (feature().unit, feature().tolerance) == (unit, 1e-5)
        assert getattr(feature, "measures_depth", False) == (feature in (LogDepth, Points3D))
