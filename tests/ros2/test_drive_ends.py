"""The driving node is stopped, paused, killed and taught; each time with a robot that moves."""

import signal
import time

import numpy as np
import pytest
from ros_cells import MOVES, PlayedRobot, assert_braked
from ros_processes import wait_until
from std_srvs.srv import Trigger


@pytest.fixture
def own(braking_cell, robsim, listener):
    """A robot and a node for one test."""
    drive = robsim("ros2", "drive", braking_cell[1])
    robot = PlayedRobot(listener, braking_cell[0])
    robot.wait_for_motion()
    yield robot, drive
    robot.close()


def test_every_signal_brakes_the_robot_before_the_node_ends(own, braking_cell, robsim):
    robot, drive = own
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        drive.signal(number)
        commands = robot.wait_for_rest()
        assert drive.finish() == 0
        assert_braked(commands)
        if number != signal.SIGHUP:
            robot.restart()
            drive = robsim("ros2", "drive", braking_cell[1])
            robot.wait_for_motion()


def test_a_paused_node_goes_on_and_a_killed_one_starts_again(own, braking_cell, robsim):
    robot, drive = own
    with drive.paused():
        time.sleep(0.3)
    robot.wait_for_motion()
    drive.finish(signal.SIGKILL)
    robot.restart()
    robsim("ros2", "drive", braking_cell[1])
    robot.wait_for_motion()


def test_the_goal_is_taught_from_the_present_image(own):
    robot, _ = own
    told = robot.listener.call(Trigger, "/robsim/teach")
    assert told.success, told.message
    wait_until(lambda: np.abs(robot.command()).max() < MOVES / 2, "rest")
