"""Arrangements of robots, cameras and targets, for the laws that all schemes obey in them."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.base.arrays import move_runs_last
from robsim.engine.plant import Plant
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.single_step import SingleStepController

HERE = rs.Pose.at()
PLATE = np.array([[-0.05, -0.06, 0], [0.06, -0.05, 0], [0.05, 0.04, 0], [-0.06, 0.06, 0]])
BENT = [0, np.radians(80), np.radians(-200), 0, np.radians(30), 0]  # Puma: the flange looks ahead
AHEAD = rs.Pose.at(1.0, 0, 0.25, rpy=(0, -np.pi / 2, 0))  # a plate before a head or a base


def _eye(name="camera", focal=500, **where):
    return rs.MountedCamera(name, rs.Camera([[focal, 0, 400], [0, focal, 400], [0, 0, 1]]), **where)


def _plate(on="world", pose=HERE, size=1.0):
    return rs.Object("plate", marks=size * PLATE, on=on, pose=pose)


def _free():
    robot = rs.robots.free_camera()
    above = rs.Pose.at(0.1, -0.05, 0.7, rotvec=(0.2, 0.1, -0.15))
    return rs.Scene([robot], [_plate(pose=above)], [_eye(on="free_camera.body")])


def _free_target():
    robot = rs.robots.free_camera().named("hand")
    above = rs.Pose.at(0.1, -0.05, 0.7, rotvec=(0.2, 0.1, -0.15))
    return rs.Scene([robot], [_plate(on="hand.body", pose=above)], [_eye()])


def _eye_in_hand():
    plate = _plate(pose=rs.Pose.at(0.31, 0, 0.1))
    return rs.Scene([rs.robots.panda()], [plate], [_eye(on="panda.flange")])


def _eye_to_hand():
    plate = _plate(on="puma560.flange", pose=rs.Pose.at(0, 0, 0.08))
    return rs.Scene([rs.robots.puma560()], [plate], [_eye(pose=rs.Pose.at(0.45, -0.15, 0.2))])


def _face_to_face():
    puma = replace(rs.robots.puma560(), home=BENT)
    there = rs.Pose.at(1.6, -0.3, 0, rpy=(0, 0, np.pi))
    plate = _plate(on="worker.flange", pose=rs.Pose.at(0, 0, 0.08))
    eye = _eye(on="watcher.flange", pose=rs.Pose.at(0, 0, 0.07))
    return rs.Scene([puma.named("worker"), puma.named("watcher").at(there)], [plate], [eye])


def _stereo_in_hand():
    plate = _plate(pose=rs.Pose.at(0.45, -0.15, 0.25))
    eyes = [
        _eye(name, on="puma560.flange", pose=rs.Pose.at(x, 0, 0.07, rpy=(0, -0.7 * x, 0)))
        for name, x in (("left", -0.06), ("right", 0.06))
    ]
    return rs.Scene([rs.robots.puma560()], [plate], eyes)


def _stereo_apart():
    """One camera on the second arm and one in the world."""
    two = _face_to_face()
    at = rs.Pose(two.pose("camera").matrix) @ rs.Pose.at(0.15, 0.05, 0, rpy=(0, -0.2, 0))
    return replace(two, cameras=[*two.cameras, _eye("other", pose=at)])


def _stereo_beside():
    """Two cameras that stand still, and an arm that carries the plate."""
    eyes = [
        _eye(name, pose=rs.Pose.at(0.45 + x, -0.15, 0.2, rpy=(0, -0.5 * x, 0)))
        for name, x in (("left", -0.1), ("right", 0.1))
    ]
    return replace(_eye_to_hand(), cameras=eyes)


def _head():
    return rs.Scene([rs.robots.pan_tilt()], [_plate(pose=AHEAD)], [_eye(on="pan_tilt.head")])


def _board():
    return _plate(pose=rs.Pose.at(1.2, 0, 0.38, rpy=(0, -np.pi / 2, 0)), size=3.0)


def _holonomic():
    eye = _eye(on="holonomic_base.camera_mount", focal=300)
    return rs.Scene([rs.robots.holonomic_base()], [_board()], [eye])


def _unicycle():
    eye = _eye(on="unicycle.camera_mount", focal=300)
    return rs.Scene([rs.robots.unicycle()], [_board()], [eye])


def _mobile_arm():
    plate = _plate(pose=rs.Pose.at(0.56, -0.1, 0.05))
    return rs.Scene([rs.robots.mobile_arm()], [plate], [_eye(on="mobile_arm.flange")])


def _turntable():
    """A head beside a turntable that carries the plate round on its own."""
    table = rs.robots.turntable().at(rs.Pose.at(1.2, 0, 0))
    at = rs.Pose.at(0.1, 0, 0.1, rpy=(0, -np.pi / 2, 0))
    eye = _eye(on="pan_tilt.head")
    plate = _plate(on="turntable.plate", pose=at)
    turn = rs.Motion("turntable", [0.2])
    return rs.Scene([rs.robots.pan_tilt(), table], [plate], [eye], [turn])


def _conveyor():
    """An arm that follows an object on a passing conveyor."""
    belt = rs.robots.conveyor().at(rs.Pose.at(0.31, 0, -0.5))
    plate = _plate(on="conveyor.belt")
    eye = _eye(on="panda.flange")
    return rs.Scene([rs.robots.panda(), belt], [plate], [eye], [rs.Motion("conveyor", [0.03])])


def _head_and_arm():
    """Two sub-scenes that have nothing to do with each other."""
    head, arm = _head(), _eye_in_hand()
    dish = replace(head.object(), name="dish", pose=rs.Pose.at(0, 2, 0) @ AHEAD)
    robots = [rs.robots.pan_tilt().at(rs.Pose.at(0, 2, 0)), *arm.robots]
    watch = replace(head.cameras[0], name="watch")
    return rs.Scene(robots, [dish, *arm.objects], [watch, *arm.cameras])


ARRANGEMENTS = {
    build.__name__[1:]: build
    for build in (
        _free,
        _free_target,
        _eye_in_hand,
        _eye_to_hand,
        _face_to_face,
        _stereo_in_hand,
        _stereo_apart,
        _stereo_beside,
        _head,
        _holonomic,
        _unicycle,
        _mobile_arm,
        _turntable,
        _conveyor,
        _head_and_arm,
    )
}


@pytest.fixture(scope="session")
def after():
    """Coordinates and velocities after some seconds of a period, all joints commanded."""

    def get(scene, q, rates, qd, dt, seconds=None, actuation=None):
        program, columns = Program(), np.arange(scene.nv)
        moved = actuation or rs.Actuation(), scene, columns
        plant = Plant(program, *moved, q[None], dt, 0, np.arange(1))
        x = plant.q if seconds is None else plant.place_within_period(program.constant(seconds)).q
        if seconds is None:
            plant.move()
        blocks = Blocks(program, np.arange(1))
        blocks.put(plant.qd, qd[:, None])
        blocks.put(plant.speed, rates[:, None])
        for part in program.segments():
            part(blocks, 1)
        return blocks.get(x, scene.nq)[:, 0], blocks.get(plant.speed, scene.nv)[:, 0]

    return get


@pytest.fixture(scope="session")
def arrange():
    """A scene by its name."""
    built = {}

    def get(name):
        return built.setdefault(name, ARRANGEMENTS[name]())

    return get


@pytest.fixture(scope="session")
def around():
    """Starts (runs, nq) near home; the laws need not converge from them."""

    def get(scene, runs=1, spread=0.03, seed=0):
        rng, each = np.random.default_rng(seed), []
        for robot in scene.robots:
            rates = spread * rng.uniform(-1, 1, (runs, robot.nv))
            each.append(robot.integrate(np.tile(robot.home, (runs, 1)), rates, 1.0))
        return np.concatenate(each, axis=1)

    return get


@pytest.fixture(scope="session")
def moved():
    """The whole world somewhere else: all that stands in it is moved by one pose."""

    def get(scene, away):
        robots = [r.at(away) if r.on == "world" else r for r in scene.robots]
        objects, cameras = (
            [replace(p, pose=away @ p.pose) if p.on == "world" else p for p in parts]
            for parts in (scene.objects, scene.cameras)
        )
        return rs.Scene(robots, objects, cameras, scene.motions)

    return get


@pytest.fixture(scope="session")
def decide():
    """The decision of a task at q (runs, nq), at one instant or after another (with memory)."""

    def get(scene, task, q, step=0, memory=None, columns=None):
        controller = task.bind(scene, columns)
        wide = move_runs_last(np.atleast_2d(q), 1)
        memory = {} if memory is None else memory
        if not memory:
            memory["alone"] = SingleStepController(controller, 0.04)
            memory["blocks"] = memory["alone"].begin(wide.shape[1])
        projections = {sight.key: sight.project(wide) for sight in controller.sights}
        pixels = {key: seen.pixels for key, seen in projections.items()}
        depth = {key: seen.depth for key, seen in projections.items()}
        return memory["alone"].decide(memory["blocks"], step, wide, pixels, depth)

    return get
