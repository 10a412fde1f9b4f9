"""Messages that fail, clocks that leap and signals: the driving node brakes, says why, goes on."""

import signal
import time

import numpy as np
import pytest
from ros_cells import DT, MOVES, NANO, PlayedRobot, assert_braked
from ros_processes import wait_until
from std_srvs.srv import Trigger


@pytest.fixture(scope="module")
def shared(braking_cell, robsim_long, listener_long):
    """A robot and the node that moves it, for all tests that do not end the node."""
    drive = robsim_long("ros2", "drive", braking_cell[1])
    robot = PlayedRobot(listener_long, braking_cell[0])
    wait_until(lambda: robot.commands, "commands")
    yield robot, drive
    robot.close()
    assert drive.finish(signal.SIGINT) == 0


@pytest.fixture
def drive(shared):
    return shared[1]


@pytest.fixture
def robot(shared):
    """A robot at its start, which the node begins to move."""
    robot, _ = shared
    robot.restart()
    assert robot.listener.call(Trigger, "/robsim/reset_drive").success
    robot.wait_for_motion()
    return robot


def test_silent_joints_stop_the_robot_until_they_return(robot, drive):
    since = drive.mark()
    robot.change = lambda marks, joints: []
    commands = robot.wait_for_rest()
    assert_braked(commands)
    drive.wait_for("joint", since=since)
    robot.change = lambda marks, joints: [joints]
    robot.wait_for_motion()


def test_silent_images_stop_the_robot_until_they_return(robot, drive):
    since, publishers = drive.mark(), robot.marks
    robot.marks = {}
    robot.change = lambda marks, joints: marks.clear() or [joints]
    assert_braked(robot.wait_for_rest())
    drive.wait_for("image", since=since)
    robot.marks, robot.change = publishers, lambda marks, joints: [joints]
    robot.wait_for_motion()


@pytest.mark.parametrize("fault", ["nan", "short", "unknown"])
def test_wrong_joints_are_not_used(robot, drive, fault):
    def change(marks, joints):
        if fault == "nan":
            joints.position[2] = float("nan")
        elif fault == "short":
            joints.position = joints.position[:-1]
        else:
            joints.name = [f"other_{name}" for name in joints.name]
        return [joints]

    since = drive.mark()
    robot.change = change
    assert_braked(robot.wait_for_rest())
    assert all(np.isfinite(np.array(m.data)).all() for _, m in robot.commands)
    assert drive.lines[since:]
    robot.change = lambda marks, joints: [joints]
    robot.wait_for_motion()


def test_doubled_and_old_joints_do_not_disturb(robot, drive):
    kept = []

    def change(marks, joints):
        kept.append(joints)
        return [joints, joints, kept[max(0, len(kept) - 4)]]

    robot.change = change
    count = len(robot.commands)
    wait_until(lambda: len(robot.commands) > count + 50, "commands")
    commands = robot.commands_since(count)
    assert np.abs(commands[5:]).max(axis=1).min() > 0.2 * MOVES
    assert_braked(commands)


def test_a_clock_that_leaps_does_not_disturb_for_long(robot, drive):
    since = len(robot.commands)
    for leap in (5 * NANO, -5 * NANO):
        robot.shift += leap
        time.sleep(3 * DT)  # some messages of the other clock
        robot.wait_for_motion()
    assert_braked(robot.commands_since(since))


def test_two_clocks_that_differ_are_reported(robot, drive):
    def change(marks, joints):
        for message in marks.values():
            message.data[0] -= 1000.0
        return [joints]

    since = drive.mark()
    robot.change = change
    drive.wait_for("clock", since=since)
    assert_braked(robot.wait_for_rest())
    robot.change = lambda marks, joints: [joints]
    robot.wait_for_motion()
