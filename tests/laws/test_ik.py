"""Inverse kinematics: solutions are at the pose and within the limits; failures have a reason."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs

HALF = np.pi / 2
REASON = rs.kinematics.IKReason


ARMS = {
    name: partial(rs.robots.load, name)
    for name in ("puma560", "panda", "ur5e", "lbr_iiwa14", "rhino_xr4")
}


def crane():
    """A boom on a rail; its second part follows its first, and a telescope is at its end."""
    rail = rs.joints.Joint("rail", curve=rs.shapes.curves.Arc(2.0, 2.0))
    arm = rs.joints.Joint("revolute", rs.Pose.at(rpy=(HALF, 0, 0)), rs.Pose.at(1, 0, 0))
    forearm = rs.joints.Joint(
        "revolute", tail=rs.Pose.at(1, 0, 0), follows=rs.joints.Mimic("arm", -2.0, 0.3)
    )
    telescope = rs.joints.Joint("prismatic", rs.Pose.at(rpy=(0, 1, 0)), limits=(0.0, 0.5))
    return rs.Robot(
        "crane",
        [
            rs.joints.Link("base"),
            rs.joints.Link("car", "base", rail),
            rs.joints.Link("arm", "car", arm),
            rs.joints.Link("forearm", "arm", forearm),
            rs.joints.Link("hook", "forearm", telescope),
        ],
    )


def random_q(robot, count, seed=0):
    """Within the limits, or half a unit around home for joints without limits."""
    rng = np.random.default_rng(seed)
    low, high = robot.limits.T
    q = robot.integrate(np.tile(robot.home, (count, 1)), rng.normal(size=(count, robot.nv)), 0.5)
    inside = np.isfinite(low)
    q[:, inside] = rng.uniform(low[inside], high[inside], (count, inside.sum()))
    return q


def metres_and_radians(T, goal):
    """(..., 2) of the difference of two poses; the angle by the chord 2 sin(angle/2)."""
    p = np.linalg.norm(T[..., :3, 3] - goal[..., :3, 3], axis=-1)
    chord = np.linalg.norm(T[..., :3, :3] - goal[..., :3, :3], axis=(-1, -2)) / np.sqrt(2)
    return np.stack([p, 2 * np.arcsin(np.clip(chord / 2, 0, 1))], axis=-1)


def within(robot, q):
    return ((q >= robot.limits[:, 0]) & (q <= robot.limits[:, 1])).all(axis=-1)


def check_honest(robot, goal, found):
    """Success is a solution within the limits, and the error agrees with forward kinematics."""
    off = metres_and_radians(robot.fk(found.q), goal).max(-1)
    np.testing.assert_allclose(found.error, off, rtol=1e-9, atol=1e-14)
    assert (found.success == (found.error < 1e-8)).all()
    assert (found.success == (found.reason == REASON.SOLVED)).all()
    assert within(robot, found.q).all()


@pytest.mark.parametrize("name", ARMS)
def test_poses_that_random_coordinates_reach_are_found_from_home(name):
    robot = ARMS[name]()
    goal = robot.fk(random_q(robot, 1000))
    found = robot.ik(goal)
    check_honest(robot, goal, found)
    assert found.success.mean() >= 0.999


@pytest.mark.parametrize("name", ARMS)
def test_of_ten_thousand_poses_one_in_a_thousand_is_missed_at_most(name):
    robot = ARMS[name]()
    goal = robot.fk(random_q(robot, 10_000, seed=1))
    found = robot.ik(goal)
    check_honest(robot, goal, found)
    assert found.success.mean() >= 0.999


@pytest.mark.parametrize(
    "robot",
    [
        rs.robots.free_camera(),
        rs.robots.holonomic_base(),
        rs.robots.mobile_arm(),
        rs.robots.conveyor(),
        rs.robots.turntable(),
        crane(),
    ],
    ids=lambda robot: robot.name,
)
def test_joints_of_other_kinds_are_brought_to_poses_too(robot):
    goal = robot.fk(random_q(robot, 200))
    found = robot.ik(goal)
    check_honest(robot, goal, found)
    assert found.success.all()


@pytest.mark.parametrize("name", ["puma560", "panda", "ur5e"])
def test_coordinates_at_limits_and_singular_ones_are_found(name):
    robot = ARMS[name]()
    rng = np.random.default_rng(2)
    q = random_q(robot, 300)
    ends = np.where(rng.random(q.shape) < 0.5, *robot.limits.T)
    q = np.where(rng.random(q.shape) < 0.5, ends, q)
    q[0] = np.clip(np.zeros(robot.nq), *robot.limits.T)
    goal = robot.fk(q)
    found = robot.ik(goal)
    check_honest(robot, goal, found)
    assert found.success.mean() > 0.99 and found.success[0]


@pytest.mark.parametrize("name", ["puma560", "panda"])
def test_a_solution_that_is_given_stays_as_it_is(name):
    robot = ARMS[name]()
    q = random_q(robot, 50)
    found = robot.ik(robot.fk(q), q)
    assert (found.q == q).all() and (found.iterations == 1).all() and (found.restarts == 0).all()


@given(seed=st.integers(0, 2**32))
@settings(derandomize=True, max_examples=20, deadline=None)
def test_near_a_solution_that_one_is_found_and_no_other(seed):
    robot = rs.robots.ur5e()
    q = random_q(robot, 50, seed)
    sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)[:, -1]
    q = q[sigma > 0.05]
    found = robot.ik(robot.fk(q), q + 1e-3)
    assert np.abs(found.q - q).max() < 1e-6


@pytest.mark.parametrize("name", ARMS)
def test_out_of_reach_is_reported_as_such_and_the_error_is_the_least_around(name):
    robot = ARMS[name]()
    goal = robot.fk(random_q(robot, 40))
    goal[:, :3, 3] *= 5.0 / np.linalg.norm(goal[:, :3, 3], axis=-1, keepdims=True)  # 5 m away
    free = robot.ik(goal, limits=False)
    assert not free.success.any() and (free.error > 2.5).all()
    assert (free.reason == REASON.UNREACHABLE).mean() > 0.9
    held = robot.ik(goal)
    check_honest(robot, goal, held)
    assert (held.reason == REASON.UNREACHABLE).mean() > 0.9


@pytest.mark.parametrize("away", [10.0, 100.0, 1e6])  # metres
def test_a_pose_far_out_of_reach_is_not_reported_as_short_of_iterations(away):
    robot = rs.robots.ur5e()
    goal = robot.fk(random_q(robot, 100))
    goal[:, :3, 3] *= away / np.linalg.norm(goal[:, :3, 3], axis=-1, keepdims=True)
    assert (robot.ik(goal).reason == REASON.UNREACHABLE).mean() > 0.9


@pytest.mark.parametrize("name", ["puma560", "panda", "lbr_iiwa14"])
def test_limits_are_the_reason_where_the_pose_is_reached_without_them(name):
    robot = ARMS[name]()
    goal = robot.fk(np.random.default_rng(3).uniform(-3, 3, (200, robot.nq)))
    held, free = robot.ik(goal), robot.ik(goal, limits=False)
    check_honest(robot, goal, held)
    assert free.success.all() and 10 < held.success.sum() < 190
    reasons = held.reason[~held.success]
    assert (reasons == REASON.LIMITS).mean() > 0.97 and REASON.UNREACHABLE not in reasons


def test_the_least_distance_of_a_planar_arm_is_known():
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 0.5, 0]], home=[0.3, 0.4])
    found = arm.ik(rs.Pose.at(3, 0, 0), mask="position")
    assert found.reason is REASON.UNREACHABLE and not found.success
    np.testing.assert_allclose(found.error, 1.5, atol=1e-4)
    inner = arm.ik(rs.Pose.at(0.2, 0, 0), mask="position")
    assert inner.reason is REASON.UNREACHABLE
    np.testing.assert_allclose(inner.error, 0.3, atol=1e-4)


def test_a_limit_in_the_way_is_reported_and_without_it_the_pose_is_reached():
    arm = rs.Robot.from_dh([[0, 0, 1, 0]], limits=[[-1.0, 1.0]])
    goal = arm.fk([2.0])
    held = arm.ik(goal)
    assert held.reason is REASON.LIMITS and held.q[0] == 1.0
    np.testing.assert_allclose(held.error, 1.0, atol=1e-12)
    np.testing.assert_allclose(arm.ik(goal, limits=False).q, [2.0], atol=1e-8)


def test_a_whole_turn_brings_a_joint_within_its_limits():
    arm = rs.Robot.from_dh([[0, 0, 1, 0]], limits=[[0.5, 6.0]], home=[1.0])
    found = arm.ik(arm.fk([5.5]))  # the short path is through 0, which is outside the limits
    assert found.success
    np.testing.assert_allclose(found.q, [5.5], atol=1e-8)


def test_few_iterations_are_reported_as_such():
    found = rs.robots.ur5e().ik(rs.Pose.at(3, 1, 2), iterations=1, restarts=0)
    assert found.reason is REASON.ITERATIONS and "more iterations" in found.reason.message
    assert found.restarts == 0 and found.iterations <= 13


@pytest.mark.parametrize("name", ["puma560", "rhino_xr4", "panda"])
def test_masks_leave_the_other_directions_free(name):
    robot = ARMS[name]()
    goal = robot.fk(random_q(robot, 300))
    spun = goal @ rs.Pose.at(rpy=(0, 0, 1.0)).matrix  # about the link's z axis
    point = robot.ik(spun, mask="pointing")
    there = robot.fk(point.q)
    assert point.success.mean() >= 0.99
    ok = point.success
    assert np.abs(there[ok, :3, 2:] - spun[ok, :3, 2:]).max() < 2e-8
    rng = np.random.default_rng(0)
    turned = goal @ rs.Pose.exp(np.c_[np.zeros((300, 3)), rng.normal(size=(300, 3))]).matrix
    where = robot.ik(turned, mask="position")
    assert where.success.all()
    assert np.linalg.norm(robot.fk(where.q)[:, :3, 3] - goal[:, :3, 3], axis=-1).max() < 1e-8


def test_flags_are_rows_in_the_axes_of_the_base():
    robot = rs.robots.puma560()
    goal = robot.fk(random_q(robot, 200))
    found = robot.ik(goal, mask=[1, 0, 1, 0, 0, 2.5])
    T = robot.fk(found.q)
    assert found.success.all()
    assert np.abs((T - goal)[:, [0, 2], 3]).max() < 1e-8
    R = goal[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)
    rotvec = np.array([rs.Pose(np.block([[r, np.zeros((3, 1))], [0, 0, 0, 1]])).rotvec for r in R])
    assert np.abs(rotvec[:, 2]).max() < 1e-8
    assert np.abs((T - goal)[:, 1, 3]).max() > 0.1 and np.abs(rotvec[:, 0]).max() > 0.1


def test_weights_count_against_each_other_alone():
    robot = rs.robots.puma560()
    goal = robot.fk(random_q(robot, 20))
    q = robot.ik(goal).q
    for weight in (1e-200, 4.0, 1e200):
        assert (robot.ik(goal, mask=[weight] * 6).q == q).all()


def test_coordinates_that_overflow_are_returned_unchanged():
    slide = rs.joints.Joint("prismatic")
    arm = rs.Robot("arm", [rs.joints.Link("base"), rs.joints.Link("tip", "base", slide)])
    found = arm.ik(rs.Pose.at(), [1e200], restarts=0)
    assert found.q == 1e200 and found.error == np.inf and found.reason is REASON.ITERATIONS
    wide = rs.joints.Joint(
        "prismatic", limits=(-1e308, 1e308)
    )  # searched where others are without limits
    arm = rs.Robot("arm", [rs.joints.Link("base"), rs.joints.Link("tip", "base", wide)])
    assert arm.ik(rs.Pose.at(z=0.4)).success


def test_a_link_that_points_straight_back_is_turned_about():
    camera, back = rs.robots.free_camera(), np.diag([1.0, -1.0, -1.0, 1.0])
    found = camera.ik(back, mask="pointing")
    assert found.success and found.restarts == 0
    np.testing.assert_allclose(camera.fk(found.q)[:3, 2], [0, 0, -1], atol=1e-8)


def test_a_middle_link_is_brought_to_its_pose_and_the_others_stay():
    robot = rs.robots.panda()
    q0 = random_q(robot, 1, seed=5)[0]
    goal = robot.fk(random_q(robot, 100), "link4")
    found = robot.ik(goal, q0, link="link4")
    assert found.success.all()
    assert metres_and_radians(robot.fk(found.q, "link4"), goal).max() < 1e-8
    assert (found.q[:, 4:] == q0[4:]).all()


# closed forms


def puma_like(a1=0.0, flip=0.0):
    rows = [
        [0.3, 0.5, a1, -HALF],
        [0.2, 0.1, 0.6, flip],
        [-0.4, 0.07, 0.05, HALF],
        [0.1, 0.5, 0, -HALF],
        [0.2, 0, 0, HALF],
        [0.3, 0.1, 0.02, 0.4],
    ]
    return rs.Robot.from_dh(rows, name="puma_like")


def five_joints():
    rows = [
        [0.3, 0.5, 0.1, -HALF],
        [0.2, 0.1, 0.6, np.pi],
        [-0.4, 0.07, 0.5, 0],
        [0.1, 0, 0.03, HALF],
        [0.2, 0.2, 0.05, 0.3],
    ]
    return rs.Robot.from_dh(rows, name="five")


CLOSED = {
    "puma560": (rs.robots.puma560(), 8),
    "puma_like": (puma_like(), 8),
    "with an offset of axis 2": (puma_like(0.1, np.pi), 8),
    "rhino_xr4": (rs.robots.rhino_xr4(), 4),
    "five": (five_joints(), 4),
}


def turns(a, b):
    """Largest difference of angles, (..., n) to (...,)."""
    return np.abs((a - b + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)


def bounded(robot, count, seed=0):
    """Within the limits, or within half a turn of zero."""
    low, high = np.where(np.isinf(robot.limits), [-np.pi, np.pi], robot.limits).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.nq))


@pytest.mark.parametrize("name", CLOSED)
def test_closed_forms_give_the_pose_and_hold_the_coordinates_that_made_it(name):
    robot, solutions = CLOSED[name]
    q = bounded(robot, 1000)
    T = robot.fk(q)
    found = robot.closed_ik(T)
    assert found.q.shape == (1000, solutions, robot.nq)
    assert (np.isnan(found.q).any(-1) == ~found.valid).all()
    b, k = np.nonzero(found.valid)
    assert np.abs(robot.fk(found.q[b, k]) - T[b]).max() < 1e-12
    assert np.nanmin(turns(found.q, q[:, None]), axis=1).max() < 1e-9
    assert found.within.any(axis=1).all() and not (found.within & ~found.valid).any()
    robot.coordinates(found.q[found.within])  # raises nothing


def test_all_eight_solutions_of_the_puma_differ():
    robot = rs.robots.puma560()
    found = robot.closed_ik(robot.fk(bounded(robot, 200)))
    assert found.valid.all()
    for i in range(8):
        for j in range(i):
            assert turns(found.q[:, i], found.q[:, j]).min() > 1e-4


@pytest.mark.parametrize("name", CLOSED)
def test_the_result_of_the_search_is_one_of_the_closed_solutions(name):
    robot, _ = CLOSED[name]
    T = robot.fk(bounded(robot, 300, seed=1))
    searched, closed = robot.ik(T, tolerance=1e-12), robot.closed_ik(T)
    ok = searched.success
    assert ok.mean() > 0.99
    apart = np.nanmin(turns(closed.q, searched.q[:, None]), axis=1)[ok]
    assert np.median(apart) < 1e-11 and apart.max() < 1e-5  # singular ones differ more


def test_poses_beyond_reach_and_poses_of_no_five_joint_arm_are_invalid():
    puma, rhino = rs.robots.puma560(), rs.robots.rhino_xr4()
    far = rs.Pose.at(0, 3, 0)
    for robot in (puma, rhino):
        found = robot.closed_ik(far)
        assert not found.valid.any() and np.isnan(found.q).all()
    leaning = rhino.fk(rhino.home) @ rs.Pose.at(rpy=(0, 0.1, 0)).matrix
    aside = rs.Pose.at(rpy=(0, 0, 0.7)).matrix @ leaning
    assert not rhino.closed_ik(aside).valid.any()
    assert not rhino.ik(aside).success


def test_a_straight_wrist_takes_the_fourth_angle_as_zero():
    robot = rs.robots.puma560()
    q = np.array([0.3, 1.0, -1.2, 0.4, 0.0, 0.5])
    found = robot.closed_ik(robot.fk(q))
    best = found.q[np.nanargmin(turns(found.q[:, :3], q[:3]))]
    np.testing.assert_allclose(best[[3, 4, 5]], [0, 0, 0.9], atol=1e-7)


def onto_the_first_axis(robot, q, wrist):
    """Coordinates with joint 2 turned until the origin of `wrist` is on axis 1, above joint 2."""
    x, _, z = robot.fk([0, 0, *q[2:]], wrist)[:3, 3] - robot.fk(q, robot.links[1].name)[:3, 3]
    return np.array([q[0], -np.arctan2(-z, x) - HALF, *q[2:]])


def plain():
    """Like the Puma, with nothing beside the plane of its arm."""
    d, a = [0.5, 0, 0, 0.4, 0, 0.1], [0, 0.4, 0.02, 0, 0, 0]
    return rs.Robot.from_dh(np.c_[np.zeros(6), d, a, [-HALF, 0, HALF, -HALF, HALF, 0]])


@pytest.mark.parametrize("q1", [0.0, 0.7, -2.0])
@pytest.mark.parametrize("q4", [0.4, -1.0])
def test_a_wrist_on_the_first_axis_has_closed_solutions(q1, q4):
    """Every plane through the axis contains it: the plane of the tool counts, or any other."""
    for robot, wrist, solutions in ((plain(), "link5", 8), (rs.robots.rhino_xr4(), "wrist", 2)):
        q = onto_the_first_axis(robot, np.array([q1, 0, 1.0, q4, 0.3, 0.2][: robot.nq]), wrist)
        T = robot.fk(q)
        assert np.hypot(*robot.fk(q, wrist)[:2, 3]) < 1e-15
        found = robot.closed_ik(T)
        assert found.valid.sum() >= solutions
        assert np.abs(robot.fk(found.q[found.valid]) - T).max() < 1e-12


def test_a_five_joint_arm_that_stands_upright_has_a_closed_solution():
    """Its hand too is on the first axis, which then turns as the last does."""
    rhino = rs.robots.rhino_xr4()
    T = rhino.fk([0.3, -HALF, 0, -HALF, 0.4])  # the hand is a wrist's 9.5 mm beside the axis
    assert rhino.closed_ik(T).valid.any()
    rows = [[0, 0.3, 0, -HALF], [0, 0, 0.2, 0], [0, 0, 0.2, 0], [0, 0, 0, -HALF], [0, 0.1, 0, 0]]
    arm = rs.Robot.from_dh(rows)
    T = arm.fk([0.3, -HALF, 0, -HALF, 0.4])
    assert np.abs(T[:2, 3]).max() < 1e-15
    found = arm.closed_ik(T)
    assert found.valid.any()
    np.testing.assert_allclose(found.q[found.valid][0, 0], 0, atol=1e-15)
