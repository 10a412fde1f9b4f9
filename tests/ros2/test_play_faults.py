"""Commands that fail, and two publishers: the played robot stops within limits, and goes on."""

import signal
import time

import numpy as np
import pytest
from ros_cells import COMMANDS, JOINTS, to_seconds
from ros_processes import wait_until
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

import robsim as rs

DT, ACCELERATION, TIMEOUT = 0.02, 1.0, 0.2
SPEED = [0.2, 0.0, 0.0, 0.0, 0.0, 0.1]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    experiment = rs.load_scenario(rs.examples.path("eye_to_hand")).with_(
        dt=DT,
        safety=rs.Safety(acceleration=ACCELERATION),
        ros2=rs.control.RosConnection(timeout=TIMEOUT),
    )
    path = tmp_path_factory.mktemp("play") / "cell.toml"
    path.write_text(experiment.to_toml(), encoding="utf-8")
    return path


class Commander:
    """Commands at a rate to a played cell, and its motion."""

    def __init__(self, listener, play):
        self.listener, self.play = listener, play
        self.states = listener.hear(JointState, JOINTS, 100)
        self.publisher = listener.publish(Float64MultiArray, COMMANDS)
        self.data = SPEED
        self.timer = listener.node.create_timer(DT, self._send)
        wait_until(lambda: len(self.states) > 1, "joint states")

    def _send(self):
        if self.data is not None:
            self.publisher.publish(Float64MultiArray(data=self.data))

    def velocities(self, count=2, since=None):
        """Return the velocities (k, nq) by the differences of the latest joints."""
        states = self.states[-count:] if since is None else self.states[since:]
        at = np.array([list(state.position) for _, state in states])
        t = np.array([to_seconds(state.header.stamp) for _, state in states])
        return np.diff(at, axis=0) / np.diff(t)[:, None]

    def wait_for_motion(self):
        wait_until(lambda: abs(self.velocities()[-1][0] - SPEED[0]) < 1e-3, "motion")

    def wait_for_rest(self):
        wait_until(lambda: np.abs(self.velocities()[-1]).max() < 1e-9, "rest")


@pytest.fixture(scope="module")
def shared(robsim_long, listener_long, path):
    """The commander of a cell that all tests share."""
    play = robsim_long("ros2", "play", path)
    found = Commander(listener_long, play)
    yield found
    found.timer.cancel()
    assert play.finish(signal.SIGINT) == 0


@pytest.fixture
def commander(shared):
    """A commander that moves the robot, which has begun at its start."""
    shared.data = None
    shared.wait_for_rest()
    assert shared.listener.call(Trigger, "/robsim/reset").success
    shared.data = SPEED
    shared.wait_for_motion()
    return shared


def test_silence_stops_the_robot_within_its_acceleration(commander):
    since, line = len(commander.states), commander.play.mark()
    commander.data = None
    commander.wait_for_rest()
    change = np.abs(np.diff(commander.velocities(since=since - 2), axis=0)).max()
    assert change <= 1.01 * ACCELERATION * DT
    commander.play.wait_for("command", since=line)
    commander.data = SPEED
    commander.wait_for_motion()


def test_wrong_commands_are_not_used(commander):
    for wrong in ([0.1] * 5, [np.nan] * 6, [np.inf] + [0.0] * 5, []):
        line = commander.play.mark()
        commander.data = wrong
        commander.wait_for_rest()
        commander.play.wait_for("command", since=line)
        commander.data = SPEED
        commander.wait_for_motion()


def test_two_publishers_stop_the_robot_until_one_is_left(commander, start):
    line = commander.play.mark()
    other = start("-c", OTHER)
    commander.play.wait_for("publishers", since=line)
    commander.wait_for_rest()
    other.finish(signal.SIGKILL)
    commander.wait_for_motion()


def test_the_cell_is_paused_stepped_and_reset(commander):
    listener = commander.listener
    clock = listener.hear(Clock, "/clock")
    wait_until(lambda: clock, "clock")
    assert listener.call(SetBool, "/robsim/pause", SetBool.Request(data=True)).success
    count = wait_until_quiet(clock)
    assert listener.call(Trigger, "/robsim/step").success
    wait_until(lambda: len(clock) == count + 1, "one instant")
    before = to_seconds(clock[-1][1].clock)
    assert listener.call(SetBool, "/robsim/pause", SetBool.Request(data=False)).success
    commander.wait_for_motion()
    commander.data = None
    commander.wait_for_rest()
    assert listener.call(Trigger, "/robsim/reset").success
    start = rs.load_scenario(rs.examples.path("eye_to_hand")).start
    wait_until(lambda: np.allclose(commander.states[-1][1].position, start), "start")
    assert to_seconds(clock[-1][1].clock) > before


def test_a_paused_process_goes_on(commander):
    with commander.play.paused():
        wait_until_quiet(commander.states)
    commander.wait_for_motion()


def wait_until_quiet(messages, pause=0.3):
    """Return the number of messages once none has come for some time."""
    wait_until(lambda: time.monotonic() - messages[-1][0] > pause, "silence")
    return len(messages)


OTHER = f"""
import rclpy
from std_msgs.msg import Float64MultiArray
rclpy.init()
node = rclpy.create_node("other")
publisher = node.create_publisher(Float64MultiArray, "{COMMANDS}", 1)
node.create_timer({DT}, lambda: publisher.publish(Float64MultiArray(data=[-0.2] + [0.0] * 5)))
rclpy.spin(node)
"""
