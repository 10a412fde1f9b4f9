"""Messages that fail, clocks that leap and signals: the driving node brakes, says why, goes on."""

import signal
import time
from itertools import pairwise

import numpy as np
import pytest
from ros_cells import NANO, PlayedRobot, eye_in_hand
from ros_processes import wait_until
from std_srvs.srv import Trigger

import robsim as rs

DT, ACCELERATION = 0.02, 1.0
MOVES = 0.05  # rad/s


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """An arm that takes long to arrive, with limits; and its file."""
    safety = rs.Safety(acceleration=ACCELERATION, watchdog=rs.control.Watchdog(0.2))
    sensing = rs.Sensing(latency=0.02)
    experiment = eye_in_hand().with_(dt=DT, sensing=sensing, safety=safety, hold=True)
    path = tmp_path_factory.mktemp("drive") / "cell.toml"
    path.write_text(experiment.at("task.gain", 0.5).to_toml(), encoding="utf-8")
    return rs.load_scenario(path), path


@pytest.fixture
def drive(cell, robsim):
    return robsim("ros2", "drive", cell[1])


@pytest.fixture
def robot(cell, listener, drive):
    """A robot that the node moves already."""
    found = PlayedRobot(listener, cell[0])
    wait_until(lambda: found.speeds()[-5:].min(initial=np.inf) > MOVES and found.commands, "motion")
    yield found
    found.close()


def wait_for_rest(robot, deadline=5.0):
    """Wait until commands are zero, or absent, and return those on the way there."""
    since = len(robot.commands)
    wait_until(lambda: robot.speeds()[-1] == 0.0, "rest", deadline)
    return [np.array(message.data) for _, message in robot.commands[since - 1 :]]


def wait_for_motion(robot, deadline=10.0):
    wait_until(lambda: robot.speeds()[-1] > MOVES, "motion", deadline)


def assert_braked(commands):
    """No command changes by more than the acceleration allows in one period."""
    changes = [np.abs(after - before).max() for before, after in pairwise(commands)]
    assert max(changes) <= 1.01 * ACCELERATION * DT


def test_silent_joints_stop_the_robot_until_they_return(robot, drive):
    since = drive.mark()
    robot.change = lambda marks, joints: []
    commands = wait_for_rest(robot)
    assert_braked(commands)
    drive.wait_for("joint", since=since)
    robot.change = lambda marks, joints: [joints]
    wait_for_motion(robot)


def test_silent_images_stop_the_robot_until_they_return(robot, drive):
    since, publishers = drive.mark(), robot.marks
    robot.marks = {}
    robot.change = lambda marks, joints: marks.clear() or [joints]
    assert_braked(wait_for_rest(robot))
    drive.wait_for("image", since=since)
    robot.marks, robot.change = publishers, lambda marks, joints: [joints]
    wait_for_motion(robot)


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
    assert_braked(wait_for_rest(robot))
    assert all(np.isfinite(np.array(m.data)).all() for _, m in robot.commands)
    assert drive.lines[since:]
    robot.change = lambda marks, joints: [joints]
    wait_for_motion(robot)


def test_doubled_and_old_joints_do_not_disturb(robot, drive):
    kept = []

    def change(marks, joints):
        kept.append(joints)
        return [joints, joints, kept[max(0, len(kept) - 4)]]

    robot.change = change
    count = len(robot.commands)
    wait_until(lambda: len(robot.commands) > count + 50, "commands")
    commands = [np.array(message.data) for _, message in robot.commands[count:]]
    assert min(np.abs(each).max() for each in commands[5:]) > 0.5 * MOVES
    assert_braked(commands)


def test_a_clock_that_leaps_does_not_disturb_for_long(robot, drive):
    since = len(robot.commands)
    for leap in (5 * NANO, -5 * NANO):
        robot.shift += leap
        time.sleep(3 * DT)  # some messages of the other clock
        wait_for_motion(robot)
    commands = [np.array(message.data) for _, message in robot.commands[since:]]
    assert_braked(commands)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_brakes_the_robot_before_the_node_ends(robot, drive, number):
    drive.signal(number)
    commands = wait_for_rest(robot)
    assert drive.finish() == 0
    assert_braked(commands)


def test_a_killed_node_starts_again_and_a_paused_one_goes_on(robot, drive, cell, robsim):
    with drive.paused():
        time.sleep(0.3)
    count = len(robot.commands)
    wait_until(lambda: len(robot.commands) > count + 10, "commands")
    wait_for_motion(robot)
    drive.finish(signal.SIGKILL)
    robsim("ros2", "drive", cell[1])
    count = len(robot.commands)
    wait_until(lambda: len(robot.commands) > count + 10, "commands of the new node")


def test_the_goal_is_taught_from_the_present_image(robot, drive, listener):
    told = listener.call(Trigger, "/robsim/teach")
    assert told.success, told.message
    wait_until(lambda: robot.speeds()[-1] < MOVES, "rest")
