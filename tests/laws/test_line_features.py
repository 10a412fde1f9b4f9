"""Segments, lines and vanishing points: L is the derivative of s, in the published form."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.features.lines import Lines, VanishingPoint
from robsim.features.segments import Segments
from robsim.testing import check_feature

steady = settings(derandomize=True, max_examples=25, deadline=None)
seeds = st.integers(0, 2**31)
angles = st.floats(-np.pi, np.pi)
PINHOLE = rs.Camera(np.eye(3))
ENDS = np.array([[0.4, 0.3, 0], [-0.4, 0.3, 0.1], [-0.1, -0.4, 0], [0.1, 0.4, -0.1]])
RAILS = np.array([[0.3, 0.2, -0.3], [0.3, 0.2, 0.3], [-0.3, -0.1, -0.4], [-0.3, -0.1, 0.3]])
BOTH = pytest.mark.parametrize("feature", [Segments(), Lines()], ids=lambda f: type(f).__name__)
EACH = pytest.mark.parametrize(
    ("feature", "marks"),
    [(Segments(), ENDS), (Lines(), ENDS), (VanishingPoint(), RAILS)],
    ids=lambda v: type(v).__name__,
)


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def observe(X):
    """The image of points (runs, marks, 3) in axes of a camera with K = I."""
    X = np.asarray(X, float)
    return rs.features.Observation.of(X[..., :2] / X[..., 2:], X[..., 2], PINHOLE)


def in_image(*points, Z=1.0):
    """One run with marks at image points, all at one depth."""
    return observe([[[Z * x, Z * y, Z] for x, y in points]])


def scattered(seed, runs=1, marks=2):
    return np.random.default_rng(seed).uniform([-0.5, -0.5, 1], [0.5, 0.5, 2], (runs, marks, 3))


def directed(angle):
    """Two marks, the second from the first in this direction."""
    return in_image((0.1, 0.2), (0.1 + 0.3 * np.cos(angle), 0.2 + 0.3 * np.sin(angle)))


@EACH
@steady
@given(seed=seeds)
@pytest.mark.few(1)
def test_the_interaction_matrix_is_the_derivative_in_50_views_each(feature, marks, seed):
    assert check_feature(feature, marks, seed, runs=50, bits=True) == []


@EACH
@steady
@given(seed=seeds, number=st.integers(1, 6))
def test_each_run_has_the_bits_that_it_has_alone(feature, marks, seed, number):
    X = scattered(seed, number, len(marks))
    s, L = feature.measure(observe(X)), feature.interaction(observe(X))
    for b in range(number):
        np.testing.assert_array_equal(feature.measure(observe(X[b : b + 1]))[0], s[b])
        np.testing.assert_array_equal(feature.interaction(observe(X[b : b + 1]))[0], L[b])


@BOTH
@steady
@given(seed=seeds)
def test_each_pair_of_marks_stands_for_itself(feature, seed):
    X = scattered(seed, marks=6)
    s, L = feature.measure(observe(X))[0], feature.interaction(observe(X))[0]
    for i, (s_i, L_i) in enumerate(zip(np.split(s, 3), np.split(L, 3), strict=True)):
        pair = observe(X[:, 2 * i : 2 * i + 2])
        np.testing.assert_array_equal(feature.measure(pair)[0], s_i)
        np.testing.assert_array_equal(feature.interaction(pair)[0], L_i)


# lines


@steady
@given(seed=seeds)
def test_both_marks_lie_on_the_line_and_it_runs_from_the_first_to_the_second(seed):
    X = scattered(seed)
    rho, theta = Lines().measure(observe(X))[0]
    p, q = X[0, :, :2] / X[0, :, 2:]
    normal, along = [np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]
    close([p @ normal, q @ normal], [rho, rho], 1e-14)
    close((q - p) @ along, np.linalg.norm(q - p), 1e-14)


@steady
@given(seed=seeds)
def test_lines_have_the_published_matrix_for_any_plane_that_holds_them(seed):
    X, rng = scattered(seed)[0], np.random.default_rng(seed)
    a, b, d = np.cross(X[1] - X[0], rng.normal(size=3))
    e = -np.array([a, b, d]) @ X[0]
    rho, theta = Lines().measure(observe([X]))[0]
    c, s = np.cos(theta), np.sin(theta)
    lambda_rho, lambda_theta = (a * rho * c + b * rho * s + d) / e, (a * s - b * c) / e
    closing = np.array([c, s, -rho])
    expected = [
        [*lambda_rho * closing, (1 + rho**2) * s, -(1 + rho**2) * c, 0],
        [*lambda_theta * closing, -rho * c, -rho * s, -1],
    ]
    size = max(1, 1 / np.linalg.norm(X[1, :2] / X[1, 2] - X[0, :2] / X[0, 2]))
    close(Lines().interaction(observe([X]))[0], expected, 1e-11 * size)


@steady
@given(seed=seeds)
def test_lines_move_as_their_two_marks_do(seed):
    """Differentiate x cos theta + y sin theta = rho at both marks: two equations, two rates."""
    X = scattered(seed)
    _, theta = Lines().measure(observe(X))[0]
    x = X[0, :, :2] / X[0, :, 2:]
    c, s = np.cos(theta), np.sin(theta)
    points = rs.features.Points().interaction(observe(X))[0].reshape(2, 2, 6)
    known = points[:, 0] * c + points[:, 1] * s
    system = np.stack([np.ones(2), x[:, 0] * s - x[:, 1] * c], axis=1)
    size = np.linalg.cond(system)
    close(Lines().interaction(observe(X))[0], np.linalg.solve(system, known), 1e-14 * size**2)


@steady
@given(seed=seeds)
def test_marks_slid_along_their_line_leave_it_as_it_is(seed):
    X, (a, b) = scattered(seed)[0], np.random.default_rng(seed).uniform(0.1, 0.4, 2)
    slid = np.array([X[0] + a * (X[1] - X[0]), X[1] - b * (X[1] - X[0])])
    one, other = observe([X]), observe([slid])
    size = max(1, 1 / np.linalg.norm(X[1, :2] / X[1, 2] - X[0, :2] / X[0, 2]))
    close(Lines().measure(other), Lines().measure(one), 1e-13 * size)
    close(Lines().interaction(other), Lines().interaction(one), 1e-12 * size**2)


@steady
@given(seed=seeds)
def test_marks_the_other_way_round_give_the_opposite_normal(seed):
    X = scattered(seed)
    rho, theta = Lines().measure(observe(X))[0]
    back = Lines().measure(observe(X[:, ::-1]))[0]
    close(back[0], -rho, 1e-14)
    close(np.exp(1j * back[1]), -np.exp(1j * theta), 1e-14)


def test_rho_goes_smoothly_through_zero():
    offsets = np.linspace(-1e-3, 1e-3, 5)
    s = np.array([Lines().measure(in_image((x, -0.3), (x, 0.2)))[0] for x in offsets])
    close(s, np.stack([offsets, np.zeros(5)], axis=1), 1e-15)


# segments


@steady
@given(seed=seeds)
def test_a_segment_gives_back_its_two_marks(seed):
    X = scattered(seed)
    *middle, length, angle = Segments().measure(observe(X))[0]
    half = 0.5 * length * np.array([np.cos(angle), np.sin(angle)])
    close([middle - half, middle + half], X[0, :, :2] / X[0, :, 2:], 1e-15)


@steady
@given(seed=seeds)
def test_a_segment_moves_so_that_its_ends_move_as_points_do(seed):
    """The inverse of the chain rule: the ends as functions of the segment, differentiated."""
    X = scattered(seed)
    *_, length, angle = Segments().measure(observe(X))[0]
    c, s = np.cos(angle), np.sin(angle)
    ends = [
        [1, 0, -c / 2, length * s / 2],
        [0, 1, -s / 2, -length * c / 2],
        [1, 0, c / 2, -length * s / 2],
        [0, 1, s / 2, length * c / 2],
    ]
    close(
        ends @ Segments().interaction(observe(X))[0],
        rs.features.Points().interaction(observe(X))[0],
        1e-14,
    )


def test_a_frontal_segment_has_the_simple_matrix():
    """Both ends at depth Z: the middle is a point but for terms in the length squared."""
    Z, half = 2.0, 0.25
    L = Segments().interaction(in_image((-half, 0), (half, 0), Z=Z))[0]
    expected = [
        [-1 / Z, 0, 0, 0, -(1 + half**2), 0],
        [0, -1 / Z, 0, 1, 0, 0],
        [0, 0, 2 * half / Z, 0, 0, 0],
        [0, 0, 0, 0, 0, -1],
    ]
    close(L, expected, 1e-15)


# angles towards a goal


@BOTH
@steady
@given(angle=angles, goal=angles)
def test_the_angle_is_the_one_within_half_a_turn_of_the_goal(feature, angle, goal):
    near = feature.towards(directed(goal))
    difference = (near.measure(directed(angle)) - near.measure(directed(goal)))[0, -1]
    assert abs(difference) <= np.pi + 1e-15  # but for rounding
    close(np.exp(1j * difference), np.exp(1j * (angle - goal)), 1e-14)


@pytest.mark.parametrize(
    ("feature", "here", "there"),
    [(Segments(), 3.1, -3.1), (Lines(), 3.1 + np.pi / 2, -3.1 + np.pi / 2)],
    ids=["segments", "lines"],
)
def test_across_half_a_turn_the_error_is_the_short_way_round(feature, here, there):
    for angle, goal, error in ((here, there, 6.2 - 2 * np.pi), (there, here, 2 * np.pi - 6.2)):
        free = (feature.measure(directed(angle)) - feature.measure(directed(goal)))[0, -1]
        assert abs(free) > 6
        near = feature.towards(directed(goal))
        close((near.measure(directed(angle)) - near.measure(directed(goal)))[0, -1], error, 1e-14)


@BOTH
def test_only_angles_are_turned_towards_the_goal(feature):
    X = scattered(5, runs=3, marks=4)
    size = 4 if isinstance(feature, Segments) else 2
    near = feature.towards(in_image((7.0, 8.0), (7.5, 9.0), (8.0, -8.0), (9.0, -9.0)))
    s, free = (f.measure(observe(X)).reshape(3, -1, size) for f in (near, feature))
    np.testing.assert_array_equal(s[..., :-1], free[..., :-1])
    np.testing.assert_array_equal(near.interaction(observe(X)), feature.interaction(observe(X)))


@BOTH
def test_a_feature_towards_a_goal_is_a_value(feature):
    here, there, elsewhere = (feature.towards(observe(scattered(i))) for i in (1, 1, 2))
    np.testing.assert_array_equal(here.goal, here.measure(observe(scattered(1))).T)
    assert here == there == pickle.loads(pickle.dumps(here))
    assert here not in (elsewhere, feature)


# vanishing points


@steady
@given(seed=seeds)
def test_parallel_lines_vanish_at_the_image_of_their_direction(seed):
    rng = np.random.default_rng(seed)
    along, start = rng.uniform([-0.5, -0.5, 0.2], [0.5, 0.5, 0.6]), scattered(seed, marks=2)[0]
    X = np.array([start[0], start[0] + along, start[1], start[1] + 0.7 * along])
    x, y = s = VanishingPoint().measure(observe([X]))[0]
    size = np.abs(along[:2]).max() / along[2] + 1
    lengths = [np.linalg.norm(np.diff(X[i : i + 2, :2] / X[i : i + 2, 2:], axis=0)) for i in (0, 2)]
    margin = 1e-12 * size / min(lengths) ** 2
    close(s, along[:2] / along[2], margin)
    expected = [[0, 0, 0, x * y, -(1 + x**2), y], [0, 0, 0, 1 + y**2, -x * y, -x]]
    close(VanishingPoint().interaction(observe([X]))[0], expected, 1e-15 * (1 + size**2))


def test_eight_marks_have_two_vanishing_points():
    X = scattered(2, runs=3, marks=8)
    s, L = VanishingPoint().measure(observe(X)), VanishingPoint().interaction(observe(X))
    for half, marks in enumerate((slice(0, 4), slice(4, 8))):
        rows = slice(2 * half, 2 * half + 2)
        np.testing.assert_array_equal(VanishingPoint().measure(observe(X[:, marks])), s[:, rows])
        np.testing.assert_array_equal(
            VanishingPoint().interaction(observe(X[:, marks])), L[:, rows]
        )


# features that do not exist


@BOTH
def test_two_marks_at_one_place_have_no_finite_interaction_matrix(feature):
    seen_there = in_image((0.1, 0.2), (0.1, 0.2), (0.1, 0.2), (0.3, 0.4))
    first, second = np.split(feature.interaction(seen_there)[0], 2)
    assert np.isnan(first[:, :5]).any(axis=0).all()
    assert np.isfinite(second).all()
    s = feature.measure(seen_there)[0]
    if isinstance(feature, Segments):
        np.testing.assert_array_equal(s[:4], [0.1, 0.2, 0, 0])
    else:
        assert np.isnan(s[:2]).all()


def test_lines_that_are_parallel_in_the_image_vanish_at_infinity():
    across = in_image((0.0, 0.25), (0.5, 0.25), (0.0, 0.5), (0.5, 0.5))
    assert not np.isfinite(VanishingPoint().measure(across)).all()
    assert not np.isfinite(VanishingPoint().interaction(across)).all()


@pytest.mark.parametrize(
    ("feature", "marks", "size"),
    [(Segments(), 3, 2), (Lines(), 1, 2), (VanishingPoint(), 6, 4), (VanishingPoint(), 2, 4)],
)
def test_marks_that_do_not_fill_the_groups_are_refused(feature, marks, size):
    words = f"{type(feature).__name__}: .* multiple of {size}; the target has {marks}"
    for act in (feature.measure, feature.interaction):
        with pytest.raises(rs.errors.InputError, match=words):
            act(observe(scattered(0, marks=marks)))


def test_units_tolerances_and_how_many_marks_each_needs():
    for feature, marks in ((Segments, 2), (Lines, 2), (VanishingPoint, 4)):
        assert (feature().unit, feature().tolerance, feature.least_marks) == ("1", 1e-5, marks)
