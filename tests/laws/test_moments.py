"""Image moments: exact for polygons, L is their derivative, invariants do not vary."""

import math
from fractions import Fraction as F
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.base.errors import InputError
from robsim.features.moments import DecoupledMoments, PointMoments, RegionMoments, measure_moments
from robsim.kernels.formulas import image_moments as kernels
from robsim.testing import check_feature

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)

L_SHAPE = np.array([[0, 0], [4, 0], [4, 1], [1.5, 1], [1.5, 3], [0, 3]]) / 10 - 0.1
PENTAGON = np.array([[-0.15, -0.1], [0.2, -0.12], [0.15, 0.1], [0.02, 0.16], [-0.12, 0.08]])
KINDS = pytest.mark.parametrize("kind", ["points", "region"])
SHAPES = pytest.mark.parametrize("shape", [L_SHAPE, PENTAGON], ids=["L", "pentagon"])
UP_TO_4 = [kernels.moment_powers(k) for k in range(kernels.ORDER_4)]


def flat(shape):
    """(N, 3): a shape in the plane z = 0 of the target."""
    return np.column_stack([shape, np.zeros(len(shape))])


def observe(points, depth=1.0):
    """Return the observation of normalised points (N, 2) at a depth or depths (N,), in one run."""
    depths = np.broadcast_to(np.asarray(depth, float), (len(points),))
    return rs.features.Observation.of(points, depths, rs.Camera(np.eye(3)))


def seen_from(T_c_o, shape):
    X = T_c_o @ flat(shape)
    return observe(X[:, :2] / X[:, 2:], X[:, 2])


def centred(points, of_marks=False):
    """Centre (2,) and moments (15,) of one polygon or set of marks."""
    x = np.asarray(points, float)[..., None]
    centre, mu = measure_moments(x, np.ones((len(x), 1)), of_marks)
    return centre[:, 0], mu[:, 0]


def random_polygons(count):
    """Yield polygons (N, 2) of 4 to 7 corners, up to 0.3 from their centre."""
    rng = np.random.default_rng(0)
    for _ in range(count):
        corners = rng.integers(4, 8)
        angle = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.8, corners)) / corners
        radius = rng.uniform(0.08, 0.3, corners)
        polygon = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        yield polygon - polygon.mean(axis=0)


@pytest.mark.parametrize(("kind", "upside_down"), [("region", 3), ("points", 2)])
def test_nearly_every_polygon_shows_its_head(kind, upside_down):
    """All third moments decide: by (mu30 + mu12, mu21 + mu03) alone it was 39 and 19 of 60."""
    wrong = 0
    for shape in random_polygons(60):
        goal = turned(0.0, shape)
        feature = DecoupledMoments(kind).towards(goal)
        turn = math.radians(150)
        start = seen_from(rs.Pose.at(0.05, 0.1, 1.2, rpy=(0, 0, turn)), shape)
        wrong += abs((feature.measure(start) - feature.measure(goal))[0, 5] - turn) > 1e-9
    assert wrong == upside_down


def about(raw, x, y):
    """Moments about (x, y) from those about the origin, both as {(i, j): m}."""
    return {
        (i, j): sum(
            math.comb(i, p) * math.comb(j, q) * (-x) ** (i - p) * (-y) ** (j - q) * raw[p, q]
            for p in range(i + 1)
            for q in range(j + 1)
        )
        for i, j in raw
    }


# moments of polygons


def test_the_unit_square_has_the_moments_of_the_integral():
    centre, mu = centred([[0, 0], [1, 0], [1, 1], [0, 1]])
    half = [1, 0, F(1, 12), 0, F(1, 80)]  # integrals of x^i over [-1/2, 1/2]
    np.testing.assert_allclose(centre, 0.5, rtol=0, atol=1e-15)
    np.testing.assert_allclose(mu, [float(half[i] * half[j]) for i, j in UP_TO_4], atol=1e-16)


def test_a_right_triangle_has_its_moments_in_factorials():
    """The integral of x^i y^j over x/a + y/b < 1 is a^(i+1) b^(j+1) i! j! / (i + j + 2)!."""
    a, b, f = F(3, 4), F(2, 5), math.factorial
    raw = {(i, j): a ** (i + 1) * b ** (j + 1) * f(i) * f(j) / f(i + j + 2) for i, j in UP_TO_4}
    exact = about(raw, a / 3, b / 3)
    centre, mu = centred([[0, 0], [0.75, 0], [0, 0.4]])
    np.testing.assert_allclose(centre, [0.25, 0.4 / 3], rtol=1e-15)
    expected = [float(exact[power]) for power in UP_TO_4]
    np.testing.assert_allclose(mu, expected, rtol=1e-13, atol=1e-18)


def scanned(polygon, i, j):
    """The integral of x^i y^j by scan lines: Gauss-Legendre between the heights of the corners."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    heights, total = np.unique(polygon[:, 1]), 0.0
    for low, high in pairwise(heights):
        for node, weight in zip(nodes, weights, strict=True):
            y, ends = low + (high - low) * (1 + node) / 2, []
            for (px, py), (qx, qy) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
                if (py > y) != (qy > y):
                    ends.append(px + (qx - px) * (y - py) / (qy - py))
            x = np.sort(ends) ** (i + 1) / (i + 1)
            total += weight * (high - low) / 2 * y**j * (x[1::2] - x[::2]).sum()
    return total


CROOKED = np.array([[0.1, 0], [0.7, -0.2], [0.5, 0.3], [0.9, 0.8], [0.4, 0.5], [-0.2, 0.6]])


@pytest.mark.parametrize("polygon", [CROOKED, L_SHAPE, PENTAGON], ids=["crooked", "L", "pentagon"])
def test_moments_agree_with_integration_by_scan_lines(polygon):
    raw = {(i, j): scanned(polygon, i, j) for i, j in UP_TO_4}
    x, y = raw[1, 0] / raw[0, 0], raw[0, 1] / raw[0, 0]
    centre, mu = centred(polygon)
    np.testing.assert_allclose(centre, [x, y], rtol=1e-13)
    exact = about(raw, x, y)
    np.testing.assert_allclose(mu, [exact[power] for power in UP_TO_4], rtol=1e-11, atol=1e-15)


def test_the_first_corner_and_the_way_round_do_not_matter():
    expected = centred(CROOKED)[1]
    for polygon in (CROOKED[::-1], np.roll(CROOKED, 2, axis=0)):
        np.testing.assert_allclose(centred(polygon)[1], expected, rtol=1e-13, atol=1e-17)
    assert expected[0] > 0


def test_a_region_far_from_the_origin_keeps_its_digits():
    mu, far = centred(CROOKED)[1], centred(CROOKED + 100)[1]
    np.testing.assert_allclose(far, mu, rtol=0, atol=1e-13)  # the corners themselves lost 1e-14


@steady
@given(seed=seeds)
def test_marks_have_the_spread_and_the_axes_of_their_covariance(seed):
    x = np.random.default_rng(seed).normal(size=(6, 2))
    size, *centre, alpha = PointMoments().measure(observe(x))[0]
    values, vectors = np.linalg.eigh(len(x) * np.cov(x.T, bias=True))
    along = vectors[:, 1]
    np.testing.assert_allclose(size, values.sum(), rtol=1e-13)
    np.testing.assert_allclose(centre, x.mean(0), atol=1e-14)
    turn = along[0] * np.sin(alpha) - along[1] * np.cos(alpha)
    assert abs(turn) < 1e-13 / (1 - values[0] / values[1])


def test_the_orientation_of_a_turned_rectangle_is_its_angle():
    for angle in (-1.5, -0.4, 0.0, 0.7, 1.5):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        rectangle = np.array([[2, 1], [-2, 1], [-2, -1], [2, -1]]) @ turn.T
        for feature in (RegionMoments(), PointMoments()):
            assert abs(feature.measure(observe(rectangle))[0, 3] - angle) < 1e-15


# interaction matrices


@pytest.mark.parametrize("feature", [RegionMoments(), DecoupledMoments("region")], ids=["s", "dec"])
@SHAPES
@steady
@given(seed=seeds)
@pytest.mark.few(1)
def test_the_interaction_matrix_of_a_region_is_its_derivative(feature, shape, seed):
    assert check_feature(feature, marks=flat(shape), seed=seed, runs=50, bits=True) == []


@pytest.mark.parametrize("feature", [PointMoments(), DecoupledMoments()], ids=["s", "dec"])
@pytest.mark.parametrize("depth", [0, 1], ids=["flat", "scattered"])
@steady
@given(seed=seeds)
@pytest.mark.few(1)
def test_the_interaction_matrix_of_marks_is_their_derivative(feature, depth, seed):
    marks = flat(PENTAGON)
    marks[:, 2] = 0.05 * depth * np.array([1, -2, 0, 3, -1])
    assert check_feature(feature, marks=marks, seed=seed, runs=50, bits=True) == []


def published(m, i, j, plane, region):
    """The row of m_ij in Chaumette (2004) for regions and Tahri and Chaumette (2005) for points."""
    A, B, C = plane
    d = int(region)

    def at(p, q):
        return m[p, q] if p >= 0 and q >= 0 else 0.0

    return np.array(
        [
            -i * (A * at(i, j) + B * at(i - 1, j + 1) + C * at(i - 1, j)) - d * A * at(i, j),
            -j * (A * at(i + 1, j - 1) + B * at(i, j) + C * at(i, j - 1)) - d * B * at(i, j),
            (i + j + 3 * d) * (A * at(i + 1, j) + B * at(i, j + 1) + C * at(i, j))
            - d * C * at(i, j),
            (i + j + 3 * d) * at(i, j + 1) + j * at(i, j - 1),
            -(i + j + 3 * d) * at(i + 1, j) - i * at(i - 1, j),
            i * at(i - 1, j + 1) - j * at(i + 1, j - 1),
        ]
    )


@KINDS
@SHAPES
def test_rows_agree_with_the_published_ones_of_raw_moments(kind, shape):
    """From m00, m10, ..., by the chain rule: a, xg, yg and the second moments about the centre."""
    view = seen_from(rs.Pose.at(0.1, -0.05, 0.9, rpy=(0.3, -0.2, 0.5)), shape)
    x = view.points_last[..., 0]
    centre, mu = centred(x, of_marks=kind == "points")
    raw = {(i, j): mu[k] for k, (i, j) in enumerate(UP_TO_4)}
    raw = about(raw, *-centre)
    plane = np.linalg.lstsq(np.column_stack([x, np.ones(len(x))]), 1 / view.depth[0], rcond=None)[0]
    row = {(i, j): published(raw, i, j, plane, kind == "region") for i, j in UP_TO_4 if i + j < 3}
    xg, yg, m00 = *centre, raw[0, 0]
    of_x, of_y = (row[1, 0] - xg * row[0, 0]) / m00, (row[0, 1] - yg * row[0, 0]) / m00
    mu20 = row[2, 0] - 2 * xg * row[1, 0] + xg**2 * row[0, 0]
    mu02 = row[0, 2] - 2 * yg * row[0, 1] + yg**2 * row[0, 0]
    mu11 = row[1, 1] - yg * row[1, 0] - xg * row[0, 1] + xg * yg * row[0, 0]
    c, s = mu[3] - mu[5], 2 * mu[4]
    alpha = 0.5 * (c * 2 * mu11 - s * (mu20 - mu02)) / (c * c + s * s)
    feature, size = (
        (RegionMoments(), row[0, 0]) if kind == "region" else (PointMoments(), mu20 + mu02)
    )
    L = feature.interaction(view)[0]
    np.testing.assert_allclose(L, [size, of_x, of_y, alpha], rtol=1e-10, atol=1e-13)


@steady
@given(seed=seeds)
def test_the_plane_of_coplanar_marks_is_found(seed):
    rng = np.random.default_rng(seed)
    A, B, C = rng.uniform([-0.3, -0.3, 0.5], [0.3, 0.3, 2])
    x = rng.uniform(-0.3, 0.3, (5, 2))
    found = np.empty((3, 1))
    depth = 1 / (A * x[:, 0] + B * x[:, 1] + C)
    kernels.fit_inverse_depth_plane(x[..., None].copy(), depth[:, None].copy(), found)
    spread = np.linalg.cond(x - x.mean(0)) ** 2
    np.testing.assert_allclose(found[:, 0], [A, B, C], atol=1e-14 * spread)


def test_a_constant_depth_is_a_plane_parallel_to_the_image():
    found = np.empty((3, 1))
    kernels.fit_inverse_depth_plane(CROOKED[..., None].copy(), np.full((6, 1), 0.7), found)
    np.testing.assert_allclose(found[:, 0], [0, 0, 1 / 0.7], rtol=0, atol=1e-15)


# decoupled moments


@KINDS
@SHAPES
@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
def test_at_a_parallel_goal_every_translation_has_its_own_feature(kind, shape, turn):
    goal = seen_from(rs.Pose.at(0.06, -0.03, 0.8, rpy=(0, 0, turn)), shape)
    feature = DecoupledMoments(kind).towards(goal)
    s, L = feature.measure(goal)[0], feature.interaction(goal)[0]
    np.testing.assert_allclose(L[:3, :3], -np.eye(3), rtol=0, atol=1e-12)
    np.testing.assert_allclose(L[3:, :3], 0, rtol=0, atol=1e-11)  # tilts and turn: no translation
    np.testing.assert_allclose(L[:, 5], [s[1], -s[0], 0, 0, 0, -1], rtol=0, atol=1e-11)
    assert abs(s[2] - 0.8) < 1e-14  # an is the depth there
    assert np.linalg.cond(L) < 200


@KINDS
@steady
@given(
    seed=seeds, angle=st.floats(-math.pi, math.pi), scale=st.floats(0.1, 10), away=st.floats(0, 2)
)
def test_the_tilt_features_are_invariant_to_similar_images(kind, seed, angle, scale, away):
    rng = np.random.default_rng(seed)
    shape = L_SHAPE * rng.uniform(0.7, 1.3, L_SHAPE.shape)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    there = shape @ turn.T + away * scale
    P, Q = (DecoupledMoments(kind).measure(observe(x))[0, 3:5] for x in (shape, there))
    np.testing.assert_allclose(Q, P, rtol=0, atol=1e-12)


@KINDS
def test_the_tilt_features_are_hus_sixth_invariant_and_its_twin(kind):
    """p^2 conj(c) with p = c21 and c = c20 in Flusser's complex moments, without unit."""
    mu = centred(L_SHAPE, of_marks=kind == "points")[1]
    (a, _, _, m20, m11, m02, m30, m21, m12, m03), spread = mu[:10], mu[3] + mu[5]
    hu6 = (m20 - m02) * ((m30 + m12) ** 2 - (m21 + m03) ** 2)
    hu6 += 4 * m11 * (m30 + m12) * (m21 + m03)
    p, c = complex(m30 + m12, m21 + m03), complex(m20 - m02, 2 * m11)
    twin = (p**2 * c.conjugate()).imag
    expected = np.array([hu6, twin]) * math.sqrt(a) / (spread**1.5 * abs(p) * abs(c))
    s = DecoupledMoments(kind).measure(observe(L_SHAPE))[0]
    np.testing.assert_allclose(s[3:5], expected, rtol=1e-12)


@KINDS
def test_the_decoupled_moments_lead_the_camera_to_the_goal(kind):
    """A free camera under V = -L^-1 e / 2 per step, from a tilt, a turn and a move."""
    at_goal, T = rs.Pose.at(0, 0, 0.8), rs.Pose.at(0.1, -0.1, 1.1, rpy=(0.15, -0.1, 1.2))
    goal = seen_from(at_goal, L_SHAPE)
    feature = DecoupledMoments(kind).towards(goal)
    for _ in range(60):
        here = seen_from(T, L_SHAPE)
        e = (feature.measure(here) - feature.measure(goal))[0]
        T = rs.Pose.exp(0.5 * np.linalg.solve(feature.interaction(here)[0], e)) @ T
    np.testing.assert_allclose(T.matrix, at_goal.matrix, rtol=0, atol=1e-9)


# angles


@pytest.mark.parametrize(
    ("feature", "row"),
    [(RegionMoments(), 3), (PointMoments(), 3), (DecoupledMoments(), 5)],
    ids=["region", "points", "decoupled"],
)
@pytest.mark.parametrize("goal_turn", [0.0, 1.5, -1.5, 3.0])
def test_the_angle_is_counted_from_that_at_the_goal(feature, row, goal_turn):
    """By how much the image has turned, up to a quarter turn either way, at any goal."""
    goal = seen_from(rs.Pose.at(0, 0, 1, rpy=(0, 0, goal_turn)), L_SHAPE)
    near = feature.towards(goal)
    for turn in (-1.5, -0.3, 0.0, 0.3, 1.5):
        here = seen_from(rs.Pose.at(0, 0, 1, rpy=(0, 0, goal_turn + turn)), L_SHAPE)
        e = near.measure(here) - near.measure(goal)
        assert abs(e[0, row] - turn) < 1e-13
    half = seen_from(rs.Pose.at(0, 0, 1, rpy=(0, 0, goal_turn + math.pi + 0.2)), L_SHAPE)
    turned_angle = 0.2 - math.pi if row == 5 else 0.2  # third moments show the head of the L
    assert abs((near.measure(half) - near.measure(goal))[0, row] - turned_angle) < 1e-13


def test_an_ellipse_measured_towards_a_goal_is_still_a_value():
    goal = observe(L_SHAPE)
    feature = RegionMoments(tolerance=1e-3)
    assert feature.towards(goal) == feature.towards(goal) != feature
    assert feature.towards(goal).tolerance == 1e-3 and feature.alpha_goal is None


def test_the_order_of_marks_agrees_with_the_border_for_regions_only():
    mixed = L_SHAPE[[0, 3, 1, 5, 2, 4]]
    s, t = (PointMoments().measure(observe(x)) for x in (L_SHAPE, mixed))
    np.testing.assert_allclose(s, t, rtol=0, atol=1e-15)


def test_an_unknown_kind_is_refused():
    with pytest.raises(InputError, match=r"'regio'; did you mean 'region'\? kinds: points, region"):
        DecoupledMoments("regio")


# the head of a target


KITE = np.array([[3, 0], [0, 1], [-1, 0], [0, -1]]) / 10
RECTANGLE = np.array([[2, 1], [-2, 1], [-2, -1], [2, -1]]) / 10
TOLD = pytest.mark.parametrize(
    ("kind", "shape"),
    [("points", KITE), ("region", KITE), ("points", PENTAGON), ("region", L_SHAPE)],
    ids=["kite", "kite region", "pentagon", "L region"],
)


def turned(turn, shape, tilt=0.0):
    return seen_from(rs.Pose.at(0, 0, 1, rpy=(tilt, tilt, turn)), shape)


@TOLD
@pytest.mark.parametrize("goal_turn", [0.0, 1.5, -1.5, 3.0])
def test_a_skewed_target_shows_turns_of_up_to_a_half(kind, shape, goal_turn):
    goal = turned(goal_turn, shape)
    feature = DecoupledMoments(kind).towards(goal)
    for turn in (-3.0, -2.0, -1.6, -0.3, 0.0, 1.5, 1.6, 2.6, 3.0):
        e = (feature.measure(turned(goal_turn + turn, shape)) - feature.measure(goal))[0]
        assert abs(e[5] - turn) < 1e-13
        assert np.abs(e[3:5]).max() < 1e-12  # the tilt features do not depend on it


@TOLD
def test_the_angle_has_no_jump_at_a_quarter_turn(kind, shape):
    """Of a tilted view too: it changes by as much as the image turns, but at half a turn."""
    goal = turned(0.0, shape)
    feature = DecoupledMoments(kind).towards(goal)
    turns = np.linspace(-2.9, 2.9, 200)
    angles = [feature.measure(turned(turn, shape, tilt=0.2))[0, 5] for turn in turns]
    assert np.abs(np.diff(angles) - np.diff(turns)).max() < 0.02


@KINDS
def test_a_target_without_a_head_is_turned_by_a_quarter_at_most(kind):
    """As before: also if a tilt makes third moments that a rectangle does not have."""
    for shape, tilt in ((RECTANGLE, 0.0), (RECTANGLE, 0.3)):
        goal = turned(0.0, shape, tilt)
        feature = DecoupledMoments(kind).towards(goal)
        assert not feature.goal[3:].any()
        half = feature.measure(turned(math.pi + 0.2, shape, tilt))[0, 5]
        assert abs(half - feature.measure(goal)[0, 5]) < math.pi / 2


@TOLD
def test_within_a_quarter_turn_the_angle_has_the_bits_of_the_axis_alone(kind, shape):
    goal = turned(0.4, shape)
    feature = DecoupledMoments(kind).towards(goal)
    axis = (RegionMoments() if kind == "region" else PointMoments()).towards(goal)
    for turn in (-1.1, -0.5, 0.0, 0.6, 1.9):
        here = turned(turn, shape, tilt=0.1)
        assert feature.measure(here)[0, 5] == axis.measure(here)[0, 3]


@TOLD
def test_a_turn_of_150_degrees_ends_upright(kind, shape, free_scene):
    """In simulation, from a turned and displaced start; before it ended upside down."""
    goal = rs.Pose.at(0, 0, -1)
    task = rs.IBVS(goal, features=DecoupledMoments(kind), tolerance=1e-6)
    start = goal @ rs.Pose.at(0.1, -0.05, -0.2, rotvec=(0, 0, np.radians(150)))
    run = rs.simulate(free_scene(flat(shape)), task, start, duration=25)
    assert int(run.outcome) == rs.Outcome.CONVERGED
    np.testing.assert_allclose(run.camera_pose[int(run.end_time / 0.04)], goal.matrix, atol=1e-4)
