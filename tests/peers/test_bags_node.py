"""The loop of the driving node, between messages of rosbags: no ROS is needed."""

import numpy as np
import pytest
from bagging import detections, frames, serialise, state

import robsim as rs
from robsim.logs import message_types
from robsim.logs.message_types import make_message
from robsim.ros2.drive_loop import DriveLoop


def load(name="chapter_6_1", **connection):
    experiment = rs.load_scenario(rs.examples.path(name))
    return experiment.with_(ros2=rs.control.RosConnection(**connection))


def begin(experiment):
    return DriveLoop(rs.Controller(experiment), experiment.ros2, make_message)


def test_the_commands_of_the_node_equal_the_simulated_ones():
    run = load().run(duration=1.0)
    joints = run.coordinate.values.tolist()
    loop = begin(
        load(
            names={name: f"arm_{name}" for name in joints},
            ids={"cube": ["a", "b", "c", "d"]},
            order=[f"arm_{name}" for name in run.velocity.values[::-1]],
        )
    )
    told = []
    for i, t in enumerate(5.0 + run.time.values):
        places = dict(zip("dcba", run.pixels.values[i][::-1], strict=True))
        loop.take_marks(detections(places, t), "camera")
        names = [f"arm_{name}" for name in joints[::-1]]
        assert loop.take_joints(state(run.q.values[i][::-1], names, t))
        assert loop.answer(t, t).phase == "moving"
        told.append(serialise(loop.make_command()).data[::-1])
    np.testing.assert_array_equal(told, run.qd)


def test_the_node_follows_a_base_by_its_frames():
    """No joints at all: map to odom does not move, odom to base does."""
    told = {"command_type": message_types.TWIST}
    places = {"world": "map", "unicycle.body": "base_link", "camera": "camera_link"}
    run = load("unicycle_docking").run(duration=1.0)
    loop = begin(load("unicycle_docking", frames=places, **told))
    assert not loop.needs_joints and loop.bases == ["unicycle.body"]
    shift = rs.Pose.at(1, 2, 0, rpy=(0, 0, 0.5))
    loop.take_still_frames(frames(("map", "odom", shift)))
    found = []
    for i, t in enumerate(5.0 + run.time.values):
        names = (f"{run.mark_target.values[0]}.{j}" for j in range(run.sizes["mark"]))
        marks = dict(zip(names, run.pixels.values[i], strict=True))
        loop.take_marks(detections(marks, t), run.mark_camera.values[0])
        x, y, theta = run.q.values[i]
        base = shift.inv() @ rs.Pose.at(x, y, 0, rpy=(0, 0, theta))
        assert loop.take_frames(frames(("odom", "base_link", base), t=t))
        loop.answer(t, t)
        twist = serialise(loop.make_command())
        found.append((twist.linear.x, twist.angular.z))
    np.testing.assert_allclose(found, run.qd, atol=1e-9)


def test_the_node_waits_for_the_permission_to_move():
    experiment = load().with_(safety=rs.Safety(hold_to_run=True))
    run, loop = load().run(duration=0.4), begin(experiment)
    moved, now = [], 10.0
    for i, word in enumerate((None, False, True, None, None)):
        now += 0.15
        if word is not None:
            loop.permit(word, now)
        t = 5.0 + 0.04 * i
        seen = {f"cube.{j}": p for j, p in enumerate(run.pixels.values[0])}
        loop.take_marks(detections(seen, t), "camera")
        assert loop.take_joints(state(run.q.values[0], run.coordinate.values.tolist(), t))
        loop.answer(t, now)
        moved.append(bool(loop.numbers.any()))
    assert moved == [False, False, True, True, False]


def test_the_node_brakes_within_the_acceleration_without_joints():
    experiment = load().with_(safety=rs.Safety(acceleration=0.5))
    run, loop = load().run(duration=0.4), begin(experiment)
    for i in range(8):
        t = 5.0 + 0.04 * i
        seen = {f"cube.{j}": p for j, p in enumerate(run.pixels.values[0])}
        loop.take_marks(detections(seen, t), "camera")
        assert loop.take_joints(state(run.q.values[0], run.coordinate.values.tolist(), t))
        loop.answer(t, t)
    speeds = [np.abs(loop.numbers).max()]
    while loop.numbers.any():
        before = loop.numbers
        loop.brake()
        assert np.abs(loop.numbers - before).max() <= 0.5 * loop.controller.dt * (1 + 1e-12)
        speeds.append(np.abs(loop.numbers).max())
    assert speeds[0] == pytest.approx(0.16) and sorted(speeds, reverse=True) == speeds


def test_wrong_joints_and_repeated_stamps_give_no_command():
    run, loop = load().run(duration=0.2), begin(load())
    names = run.coordinate.values.tolist()
    seen = {f"cube.{i}": p for i, p in enumerate(run.pixels.values[0])}
    loop.take_marks(detections(seen, 5.0), "camera")
    assert loop.take_joints(state(run.q.values[0], names, 5.0))
    first = loop.answer(5.0, 0.0)
    np.testing.assert_array_equal(first.velocities, run.qd.values[0])
    assert loop.answer(5.0, 0.001) is None
    assert not loop.take_joints(state([], [], 5.02))
    with pytest.raises(rs.errors.InputError, match="shoulder is nan"):
        loop.take_joints(state([np.nan] * 5, names, 5.04))
    np.testing.assert_array_equal(loop.q, run.q.values[0])
