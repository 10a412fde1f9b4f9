"""Manipulability, singularities and workspaces: closed forms, invariances, the same bits again."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim import robots
from robsim.kinematics import (
    condition_number,
    manipulability,
    sample_workspace,
    singularity_distance,
)

RANDOM = settings(derandomize=True, deadline=None, max_examples=25)
LENGTHS = st.floats(0.05, 3)
ANGLES = st.floats(-np.pi, np.pi)


def two_links(a, b, **more):
    return rs.Robot.from_dh([[0, 0, a, 0], [0, 0, b, 0]], **more)


def anywhere(robot, runs=40, seed=0):
    """Configurations within two radians and two metres of home."""
    rates = np.random.default_rng(seed).uniform(-2, 2, (runs, robot.nv))
    return robot.integrate(np.tile(robot.home, (runs, 1)), rates, 1.0)


# ---- manipulability ----


@RANDOM
@given(LENGTHS, LENGTHS, ANGLES, ANGLES, LENGTHS)
def test_two_links_have_the_area_of_their_parallelogram(a, b, q1, q2, unit):
    """Yoshikawa 1985: l1 l2 |sin q2|, here in squares of the unit of length."""
    found = manipulability(two_links(a, b), [q1, q2], axes="linear", length=unit)
    assert found == pytest.approx(a * b * abs(np.sin(q2)) / unit**2, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("name", ["puma560", "ur5e", "stanford_arm", "panda", "lbr_iiwa14"])
@pytest.mark.parametrize("axes", ["all", "linear", "angular"])
def test_where_joints_suffice_it_is_yoshikawas_determinant(name, axes):
    robot = robots.load(name)
    q = anywhere(robot)
    rows = {"all": slice(6), "linear": slice(3), "angular": slice(3, 6)}[axes]
    J = robot.jacobian(q)[:, rows]
    expected = np.sqrt(np.maximum(np.linalg.det(J @ J.transpose(0, 2, 1)), 0))
    assert expected.max() > 0.01
    np.testing.assert_allclose(manipulability(robot, q, axes=axes), expected, rtol=1e-6, atol=1e-8)


def test_with_fewer_joints_it_is_the_volume_that_they_span():
    """sqrt(det(J^T J)), which is not zero as sqrt(det(J J^T)) is."""
    for name in ("rhino_xr4", "scara", "planar_2r", "planar_3r", "pan_tilt"):
        robot = robots.load(name)
        q = anywhere(robot)
        J = robot.jacobian(q)
        expected = np.sqrt(np.maximum(np.linalg.det(J.transpose(0, 2, 1) @ J), 0))
        np.testing.assert_allclose(manipulability(robot, q), expected, rtol=1e-6, atol=1e-8)


def test_an_arm_in_a_plane_is_measured_in_it_however_the_plane_lies():
    arm = robots.planar_3r()
    q = anywhere(arm)
    J = arm.jacobian(q)[:, :2]
    expected = np.sqrt(np.linalg.det(J @ J.transpose(0, 2, 1)))
    np.testing.assert_allclose(manipulability(arm, q, axes="linear"), expected, atol=1e-12)
    tilted = rs.joints.Joint("fixed", rs.Pose.at(0.1, 0.2, 0.3, rpy=(0.4, 0.5, 0.6)))
    first, *others = arm.links[1:]
    links = (
        arm.links[0],
        rs.joints.Link("wedge", "base", tilted),
        replace(first, parent="wedge"),
        *others,
    )
    found = manipulability(rs.Robot("tilted", links), q, axes="linear")
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_the_scara_moves_its_tool_as_two_links_and_a_slide():
    scara = robots.scara()
    q = anywhere(scara)
    expected = 0.425 * 0.375 * np.abs(np.sin(q[:, 1]))
    np.testing.assert_allclose(manipulability(scara, q, axes="linear"), expected, atol=1e-12)
    angular = manipulability(scara, q, axes="angular")  # three joints, one direction
    np.testing.assert_allclose(angular, np.sqrt(3), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("name", "slides"), [("puma560", 0), ("ur5e", 0), ("stanford_arm", 1)])
@pytest.mark.parametrize("unit", [0.2, 3.0])
def test_the_unit_of_length_scales_the_measure_of_six_joints(name, slides, unit):
    """det(S J D): three rows are divided by the unit, the columns of slides multiplied by it."""
    robot = robots.load(name)
    q = anywhere(robot)
    ratio = manipulability(robot, q, length=unit) / manipulability(robot, q)
    np.testing.assert_allclose(ratio, unit ** (slides - 3.0), rtol=1e-6)


@pytest.mark.parametrize("axes", ["all", "linear", "angular"])
def test_a_flying_body_has_the_same_manipulability_everywhere_in_any_unit(axes):
    free = robots.free_camera()
    q = anywhere(free)
    for unit in (0.1, 1.0, 7.0):
        for measure in (manipulability, singularity_distance, condition_number):
            np.testing.assert_allclose(measure(free, q, axes=axes, length=unit), 1, atol=1e-12)


def test_a_link_that_never_moves_so_has_none():
    gantry, q = robots.gantry(), [[0.1, 0.2, 0.3], [0.0, 0.0, 0.5]]
    np.testing.assert_array_equal(manipulability(gantry, q, axes="angular"), [0, 0])
    np.testing.assert_array_equal(singularity_distance(gantry, q, axes="angular"), [0, 0])
    np.testing.assert_array_equal(condition_number(gantry, q, axes="angular"), [np.inf, np.inf])
    np.testing.assert_array_equal(manipulability(gantry, q, "base"), [0, 0])
    np.testing.assert_array_equal(manipulability(gantry, q, "bridge", "linear"), [1, 1])
    post = rs.Robot("post", [rs.joints.Link("base")])
    assert (manipulability(post, []), condition_number(post, [])) == (0, np.inf)


@pytest.mark.parametrize("name", ["puma560", "panda", "scara", "unicycle", "mobile_arm"])
def test_rows_do_not_depend_on_the_batch(name):
    robot = robots.load(name)
    q = anywhere(robot, 12).reshape(3, 4, -1)
    for measure in (manipulability, singularity_distance, condition_number):
        found = measure(robot, q)
        assert found.shape == (3, 4)
        np.testing.assert_array_equal(found, [[measure(robot, each) for each in row] for row in q])


@pytest.mark.parametrize("name", ["puma560", "kinova_gen3", "stanford_arm"])
def test_a_turn_of_the_first_joint_changes_nothing(name):
    robot = robots.load(name)
    q = anywhere(robot)
    turned = q + 0.9 * np.eye(robot.nq)[0]
    for axes in ("all", "linear", "angular"):
        for measure in (manipulability, singularity_distance):
            a, b = (measure(robot, each, axes=axes) for each in (q, turned))
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)


# ---- singularities ----


@RANDOM
@given(LENGTHS, LENGTHS, ANGLES, st.floats(-1e-4, 1e-4), st.booleans())
def test_two_links_in_line_are_singular_and_the_distance_grows_with_the_angle(a, b, q1, bend, fold):
    arm, reach = two_links(a, b), a - b if fold else a + b
    q = [q1, (np.pi if fold else 0.0) + bend]
    expected = a * b * abs(bend) / np.hypot(reach, b)  # product over the largest, to first order
    found = singularity_distance(arm, q, axes="linear")
    assert found == pytest.approx(expected, rel=1e-2, abs=1e-12)
    if abs(bend) > 1e-8:
        product = found**2 * condition_number(arm, q, axes="linear")
        assert product == pytest.approx(manipulability(arm, q, axes="linear"), rel=1e-6)


def test_the_puma_is_singular_at_its_wrist_elbow_and_shoulder():
    puma = robots.puma560()
    q = anywhere(puma, 30, seed=3)
    assert singularity_distance(puma, q).max() > 0.1
    wrist, elbow, shoulder = q.copy(), q.copy(), q.copy()
    wrist[::2, 4], wrist[1::2, 4] = 0, np.pi
    elbow[:, 2] = np.arctan2(-0.4318, 0.0203)  # shoulder, elbow and wrist in line
    # the wrist above the axis of the base: a2 c2 + a3 c23 - d4 s23 = 0
    c3, s3 = np.cos(q[:, 2]), np.sin(q[:, 2])
    along, across = 0.4318 + 0.0203 * c3 - 0.4318 * s3, 0.0203 * s3 + 0.4318 * c3
    shoulder[:, 1] = np.arctan2(along, across)
    for singular in (wrist, elbow, shoulder):
        distance = singularity_distance(puma, singular)
        np.testing.assert_allclose(distance, 0, rtol=0, atol=1e-12)
        np.testing.assert_allclose(manipulability(puma, singular), 0, rtol=0, atol=1e-12)
        assert condition_number(puma, singular).min() > 1e10


def test_an_isotropic_finger_has_condition_one():
    """Salisbury and Craig 1982: links of sqrt(2) and 1, the second bent by 135 degrees."""
    finger = two_links(np.sqrt(2), 1)
    q = np.radians([[0, 135], [70, -135], [0, 90]])
    found = condition_number(finger, q, axes="linear")
    np.testing.assert_allclose(found[:2], 1, rtol=0, atol=1e-12)
    assert found[2] > 1.5


# ---- workspace ----


@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0), (1.0, 0.6), (0.5, 0.8)])
def test_two_links_reach_the_whole_ring_and_nothing_else(a, b):
    arm = two_links(a, b, limits=np.radians([[-180, 180], [-180, 180]]))
    found = sample_workspace(arm, count=4000)
    far = np.linalg.norm(found.points, axis=1)
    assert far.max() <= a + b + 1e-12 and far.min() >= abs(a - b) - 1e-12
    assert far.max() > 0.999 * (a + b) and far.min() < abs(a - b) + 0.01
    around = np.arctan2(found.points[:, 1], found.points[:, 0])
    counts, _ = np.histogram(around, 12, (-np.pi, np.pi))
    assert counts.min() > 250  # 333 expected in each
    expected = a * b * np.abs(np.sin(found.q[:, 1]))
    np.testing.assert_allclose(found.manipulability, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["panda", "scara", "stanford_arm", "kinova_gen3"])
def test_joints_are_uniform_within_their_limits_and_the_points_are_theirs(name):
    robot = robots.load(name)
    found = sample_workspace(robot, count=3000, seed=4)
    low, high = robot.limits.T
    free = np.isinf(low)
    low[free], high[free] = robot.home[free] - np.pi, robot.home[free] + np.pi
    share = (found.q - low) / (high - low)
    assert share.min() > 0 and share.max() < 1
    np.testing.assert_allclose(share.mean(axis=0), 0.5, atol=0.02)  # 4 sigma
    np.testing.assert_allclose(share.std(axis=0), np.sqrt(1 / 12), atol=0.01)
    assert np.abs(np.corrcoef(share.T) - np.eye(robot.nq)).max() < 0.08
    np.testing.assert_array_equal(found.points, robot.fk(found.q)[:, :3, 3])
    expected = manipulability(robot, found.q, axes="linear")
    np.testing.assert_array_equal(found.manipulability, expected)
    assert (found.robot, found.link, found.axes) == (robot, robot.tip, "linear")


def test_the_same_seed_gives_the_same_bits_and_more_begin_with_fewer():
    puma = robots.puma560()
    many, few = (
        sample_workspace(puma, 8300, seed=7),
        sample_workspace(puma, 900, seed=7),
    )  # more than a chunk
    for part in ("q", "points", "manipulability"):
        np.testing.assert_array_equal(getattr(many, part)[:900], getattr(few, part))
        assert not getattr(many, part).flags.writeable
    assert few == sample_workspace(puma, 900, seed=7) and few != sample_workspace(puma, 900, seed=8)
    assert np.abs(sample_workspace(puma, 900, seed=2**64 - 1).q - few.q).min() > 0


def test_another_link_and_other_axes_can_be_followed():
    puma = robots.puma560()
    elbow = sample_workspace(puma, 500, link="upper_arm", axes="all", length=0.5)
    height = elbow.points - [0, 0, 0.67183]
    np.testing.assert_allclose(np.linalg.norm(height, axis=1), 0.4318, rtol=0, atol=1e-12)
    expected = manipulability(puma, elbow.q, "upper_arm", "all", 0.5)
    np.testing.assert_array_equal(elbow.manipulability, expected)
    assert str(elbow).startswith("puma560.upper_arm in 500 configurations\nx -0.4")


def test_a_joint_without_limits_makes_one_turn_whatever_it_is_called():
    turn = rs.joints.Joint("revolute", name="shoulder", tail=rs.Pose.at(1, 0, 0))
    found = sample_workspace(
        rs.Robot("r", [rs.joints.Link("base"), rs.joints.Link("arm", "base", turn)]), 1000
    )
    assert -np.pi < found.q.min() < -3 and 3 < found.q.max() < np.pi


# ---- bad input ----


@pytest.mark.parametrize("measure", [manipulability, singularity_distance, condition_number])
def test_a_joint_without_a_measure_is_reported(measure):
    arm = robots.planar_2r()
    with pytest.raises(rs.errors.InputError, match="no axes 'liner'; did you mean 'linear'"):
        measure(arm, arm.home, axes="liner")
    with pytest.raises(rs.errors.InputError, match=r"no axes \['x'\]; axes: all, linear, angular"):
        measure(arm, arm.home, axes=["x"])
    with pytest.raises(rs.errors.InputError, match=r"length \(metres\) must be a positive number"):
        measure(arm, arm.home, length=0)
    with pytest.raises(rs.errors.FrameError, match="no frame 'tool' in robot 'planar_2r'"):
        measure(arm, arm.home, "tool")
    with pytest.raises(rs.errors.InputError, match=r"q: expected shape \(\.\.\., 2\), got \(3,\)"):
        measure(arm, [0, 0, 0])
    with pytest.raises(rs.errors.InputError, match="expected a Robot, got 'planar_2r'"):
        measure("planar_2r", arm.home)


def test_a_workspace_without_end_is_refused_by_the_names_of_its_joints():
    with pytest.raises(
        rs.errors.InputError, match=r"'unicycle' is unbounded: no limits for 'body.x', 'b"
    ):
        sample_workspace(robots.unicycle())
    with pytest.raises(
        rs.errors.InputError, match=r"no limits for 'body\.x', .*'body\.qw'; expected"
    ):
        sample_workspace(robots.free_camera())
    lift = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 0, 0]], joints="RP")
    with pytest.raises(
        rs.errors.InputError, match="'robot' is unbounded: no limits for 'link2'; expected"
    ):
        sample_workspace(lift)
    with pytest.raises(rs.errors.InputError, match="robot 'post' has no joint that moves"):
        sample_workspace(rs.Robot("post", [rs.joints.Link("base")]))
    with pytest.raises(rs.errors.InputError, match="expected a Robot, got 3"):
        sample_workspace(3)
    for count in (0, 1.5, 2_000_000):
        with pytest.raises(rs.errors.InputError, match="count must be"):
            sample_workspace(robots.planar_2r(), count)
    with pytest.raises(rs.errors.InputError, match="seed must be a whole number"):
        sample_workspace(robots.planar_2r(), 5, seed=-1)
