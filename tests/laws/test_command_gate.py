"""The commands of a played robot: limits, timeouts, and several publishers."""

import numpy as np
import pytest

import robsim as rs
from robsim.ros2.command_gate import CommandGate

DT, SPEED = 0.1, np.array([0.2, -0.1])


@pytest.fixture
def gate():
    scene = rs.Scene([rs.robots.planar_2r()])
    return CommandGate(scene, np.arange(2), DT, 0.5, np.array([1.0, 1.0]))


def test_a_robot_without_commands_waits_and_then_follows(gate):
    assert not gate.next_command(np.zeros(2), 0.0).any()
    assert gate.reason == "waits for the first command"
    gate.take(SPEED, 0.05)
    np.testing.assert_array_equal(gate.next_command(np.zeros(2), 0.1), SPEED)
    assert gate.reason == ""


def test_silence_brakes_within_the_acceleration_and_in_one_direction(gate):
    gate.take(SPEED, 0.0)
    gate.next_command(np.zeros(2), 0.0)
    found = [gate.next_command(np.zeros(2), t) for t in (0.6, 0.7, 0.8)]
    np.testing.assert_allclose(found, [SPEED / 2, 0 * SPEED, 0 * SPEED], atol=1e-15)
    assert gate.reason == "no command for 0.5 s: the robot brakes"
    gate.take(SPEED, 0.9)
    np.testing.assert_array_equal(gate.next_command(np.zeros(2), 0.9), SPEED)


def test_a_wrong_message_leaves_the_last_command_until_its_timeout(gate):
    gate.take(SPEED, 0.0)
    gate.refuse("5 numbers")
    np.testing.assert_array_equal(gate.next_command(np.zeros(2), 0.1), SPEED)
    assert gate.reason == "5 numbers"
    gate.next_command(np.zeros(2), 0.7)
    assert gate.reason == "5 numbers: the robot brakes"


def test_commands_of_two_publishers_brake_until_one_is_left(gate):
    gate.take(SPEED, 0.0, b"first")
    gate.next_command(np.zeros(2), 0.0)
    gate.take(-SPEED, 0.1, b"second")
    np.testing.assert_allclose(gate.next_command(np.zeros(2), 0.1), SPEED / 2)
    assert gate.reason == "commands of 2 publishers: the robot brakes until one is left"
    gate.take(SPEED, 0.55, b"first")
    assert not gate.next_command(np.zeros(2), 0.55).any()
    gate.take(SPEED, 0.65, b"first")
    np.testing.assert_array_equal(gate.next_command(np.zeros(2), 0.65), SPEED)
    assert gate.reason == ""


def test_a_fast_command_keeps_its_direction():
    turn = rs.joints.Joint("revolute", speed=2.0)
    links = [rs.joints.Link("base"), rs.joints.Link("a", "base", turn)]
    links.append(rs.joints.Link("b", "a", rs.joints.Joint("revolute")))
    gate = CommandGate(rs.Scene([rs.Robot("arm", links)]), np.arange(2), DT, 0.5)
    gate.take(np.array([-4.0, 1.0]), 0.0)
    np.testing.assert_allclose(gate.next_command(np.zeros(2), 0.0), [-2.0, 0.5])
    assert gate.reason == "the command is scaled to the speed of joint a"


def test_torques_have_no_limits_of_velocities():
    scene = rs.Scene([rs.robots.load("ur5e")])
    gate = CommandGate(scene, np.arange(6), 0.01, 0.5, np.ones(6), torques=True)
    torques = np.array([50.0, -150.0, 100.0, 1.0, 0.0, 0.0])
    gate.take(torques, 0.0)
    np.testing.assert_array_equal(gate.next_command(scene.limits[:, 1], 0.0), torques)
    assert not gate.next_command(scene.home, 1.0).any()


def test_joints_stop_at_their_limits_and_may_leave_them():
    scene = rs.load_scenario(rs.examples.path("eye_in_hand")).scene
    high = scene.limits[0, 1]
    gate = CommandGate(scene, np.arange(7), DT, 0.5)
    q, turn = scene.home.copy(), np.eye(7)[0]
    q[0] = high - 0.02
    gate.take(turn, 0.0)
    assert gate.next_command(q, 0.0)[0] == pytest.approx(0.2)
    assert gate.reason == f"a joint stops at its limit: {scene.velocity_names[0]}"
    q[0] = high + 0.1  # carried beyond by its dynamics
    assert gate.next_command(q, 0.1)[0] == 0.0
    gate.take(-turn, 0.2)
    np.testing.assert_array_equal(gate.next_command(q, 0.2), -turn)
    assert gate.reason == ""


def test_a_reset_robot_waits_again(gate):
    gate.take(SPEED, 0.0)
    gate.stop()
    assert not gate.next_command(np.zeros(2), 0.1).any()
    assert gate.reason == "waits for the first command"
