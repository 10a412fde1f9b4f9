"""Poses, Jacobians and closed forms have the same bits alone, in any batch, and however given."""

import numpy as np
import pytest

import robsim as rs
from robsim.base.unit_warnings import LARGEST_RADIANS
from robsim.kernels.bodies import batch_kinematics

BATCH = 32 * batch_kinematics.WIDTH + 3  # whole blocks and a part of one


def screw():
    """An arm with a joint of a kind of its own: a screw."""

    class Screw(rs.joints.JointKind):
        name, coordinates, units = "screw", ("",), ("rad",)

        def motion(self, q):
            return rs.Pose.exp(q * [0, 0, 0.1, 0, 0, 1]).matrix

        def twists(self, q):
            return np.broadcast_to([0, 0, 0.1, 0, 0, 1.0], (len(q), 1, 6))

    links = (
        rs.joints.Link("base"),
        rs.joints.Link("nut", "base", rs.joints.Joint(Screw(), rs.Pose.at(1, 0, 0))),
    )
    return rs.Robot("press", links)


ROBOTS = {
    name: rs.robots.load(name)
    for name in ("puma560", "scara", "free_camera", "car", "conveyor", "mobile_arm")
} | {"screw": screw(), "bare": rs.Robot("bare", rs.joints.Link("base"))}


def make_batch(robot, count=BATCH):
    rates = np.random.default_rng(3).normal(size=(count, robot.nv))
    return robot.integrate(np.tile(robot.home, (count, 1)), rates, 0.7)


def same(a, b):
    assert a.shape == b.shape and a.tobytes() == b.tobytes()


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("method", ["fk", "frames", "jacobian"])
def test_a_configuration_alone_equals_its_row_in_any_batch(name, method):
    robot = ROBOTS[name]
    q, call = make_batch(robot), getattr(robot, method)
    whole = call(q)
    for i in (0, 1, batch_kinematics.WIDTH - 1, batch_kinematics.WIDTH, BATCH - 1):
        same(call(q[i]), whole[i])
    for rows in (slice(3, 4), slice(100, 250), slice(None, None, -1), slice(0, 0)):
        same(call(q[rows]), whole[rows])
    same(call(q[:256].reshape(2, 128, -1)), whole[:256].reshape(2, 128, *whole.shape[1:]))


@pytest.mark.parametrize("name", ROBOTS)
def test_they_agree_with_the_tree_that_a_simulation_moves(name):
    robot = ROBOTS[name]
    q, tree = make_batch(robot, 5), robot.tree
    bodies = tree.bodies(np.ascontiguousarray(q.T))
    same(robot.fk(q)[:, :3], np.moveaxis(tree.frame(bodies, robot.tip), -1, 0).copy())
    same(robot.jacobian(q), np.moveaxis(tree.jacobian(bodies, robot.tip), -1, 0).copy())


def test_it_does_not_matter_how_coordinates_are_given():
    robot = ROBOTS["puma560"]
    q = np.float64(np.float32(make_batch(robot, 4)))
    fixed = q.copy()
    fixed.flags.writeable = False
    ways = q.tolist(), fixed, np.asfortranarray(q), q.astype(">f8"), np.float32(q), q[::-1][::-1]
    for way in ways:
        same(robot.fk(way), robot.fk(q))
        same(robot.jacobian(way), robot.jacobian(q))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [0, 200])
@pytest.mark.parametrize("method", ["fk", "frames", "jacobian"])
def test_an_unusual_finding_of_a_kernel_is_an_error(value, row, method):
    q = make_batch(ROBOTS["puma560"])
    q[row, 3] = value
    with pytest.raises(rs.errors.InputError, match=rf"q: {value} at index \({row}, 3\)"):
        getattr(ROBOTS["puma560"], method)(q)


def test_possible_degrees_are_unusual_and_large_angles_of_computations_pass():
    assert batch_kinematics.USUAL_COORDINATE <= LARGEST_RADIANS
    robot = ROBOTS["puma560"]
    q = make_batch(robot)
    turned = q + 2 * np.pi * 50
    np.testing.assert_allclose(robot.fk(turned), robot.fk(q), rtol=0, atol=1e-12)
    q[200, 5] = -45.0
    with pytest.warns(rs.errors.UnitWarning, match="q: 45 looks like degrees") as record:
        robot.jacobian(q)
    assert record[0].filename == __file__


@pytest.mark.parametrize("name", ["puma560", "rhino_xr4"])
def test_a_closed_form_alone_equals_its_row_in_any_batch(name):
    robot = rs.robots.load(name)
    T = robot.fk(make_batch(robot, 20))
    T[::3, :3, 3] *= 1.7
    whole = robot.closed_ik(T)
    assert 0 < whole.valid.mean() < 1
    for rows in (0, 7, 8, slice(3, 12), slice(None, None, -1), slice(0, 0)):
        found = robot.closed_ik(T[rows])
        for part in ("q", "valid", "within"):
            same(getattr(found, part), getattr(whole, part)[rows])


def test_the_memory_of_one_search_does_not_change_the_next():
    used = rs.robots.panda().named("used")
    T = used.fk(make_batch(used, 30))
    ways = (
        {},
        {"seed": 5},
        {"restarts": 7},
        {"limits": False},
        {"mask": "position"},
        {"mask": [1, 1, 1, 0, 0, 1]},
        {"mask": "pointing", "link": "link6"},
        {},
    )
    for way in ways:
        fresh = used.named("fresh")
        found, expected = used.ik(T, **way), fresh.ik(T, **way)
        for part in ("q", "error", "iterations", "restarts", "reason"):
            same(getattr(found, part), getattr(expected, part))
