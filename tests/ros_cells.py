"""Experiments that are played and driven over ROS 2, and a robot that publishes as it is told."""

import threading
import time
from pathlib import Path

import numpy as np
from ros_processes import DEADLINE, wait_until

import robsim as rs

ROOT = Path(__file__).parents[1]
NANO = 10**9
JOINTS, COMMANDS = "/joint_states", "/forward_velocity_controller/commands"
DT, ACCELERATION = 0.02, 1.0  # of `braking_experiment`
MOVES = 0.05  # rad/s
LATE = {"dt": 0.02, "sensing": rs.Sensing(latency=0.03)}


def eye_in_hand():
    """A camera on an arm, with noise, and images that are late and rare."""
    return rs.load_scenario(ROOT / "ros2/robsim_ros/config/cell.toml").at("task.gain", 2.0)


def eye_to_hand():
    """A camera on the floor."""
    experiment = rs.load_scenario(rs.examples.path("eye_to_hand"))
    return experiment.with_(**LATE).at("task.gain", 3.0)


def mobile_base():
    """A base that cannot move sideways."""
    experiment = rs.load_scenario(rs.examples.path("unicycle_docking"))
    return experiment.with_(**LATE).at("task.tolerance", 0.01).at("task.gain", 2.0)


def rendered_tag():
    """A tag that a detector finds in pictures."""
    experiment = rs.load_scenario(ROOT / "examples/tag_cell/cell.toml")
    return experiment.at("task.detector", "tag_tracker")


CELLS = (eye_in_hand, eye_to_hand, mobile_base, rendered_tag)


def to_seconds(stamp):
    """Return a stamp in seconds."""
    return stamp.sec + stamp.nanosec / NANO


def braking_experiment():
    """An arm that takes long to arrive, with a limit of its acceleration and a watchdog."""
    safety = rs.Safety(acceleration=ACCELERATION, watchdog=rs.control.Watchdog(0.2))
    sensing = rs.Sensing(latency=0.02)
    experiment = eye_in_hand().with_(dt=DT, sensing=sensing, safety=safety, hold=True)
    return experiment.at("task.gain", 0.5)


def assert_braked(commands):
    """No command (k, n) changes by more than the acceleration allows in one period."""
    assert np.abs(np.diff(commands, axis=0)).max() <= 1.01 * ACCELERATION * DT


class Coordinates:
    """The coordinates of an experiment by their times, from the messages of a listener."""

    def __init__(self, listener, experiment):
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import JointState

        self.names = list(experiment.scene.coordinate_names)
        self.joints = listener.hear(JointState, JOINTS, 1000)
        self.bases = listener.hear(Odometry, "/odom", 1000)

    def by_time(self):
        """Return the coordinates (nq,) by their times in seconds."""
        found = {}
        for _, state in list(self.joints):
            if set(self.names) <= set(state.name):
                at = [state.position[state.name.index(name)] for name in self.names]
                found[to_seconds(state.header.stamp)] = np.array(at)
        for _, odometry in list(self.bases):
            at, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
            heading = 2 * np.arctan2(turn.z, turn.w)
            heading = (heading + np.pi) % (2 * np.pi) - np.pi
            found[to_seconds(odometry.header.stamp)] = np.array([at.x, at.y, heading])
        return found

    def latest(self):
        """Return the latest coordinates (nq,), or NaN before the first."""
        found = self.by_time()
        return found[max(found)] if found else np.full(len(self.names), np.nan)


class JointMotion:
    """The velocities of joints by the differences of their states."""

    def __init__(self, listener):
        from sensor_msgs.msg import JointState

        self.states = listener.hear(JointState, JOINTS, 100)

    def count(self):
        """Return the number of states."""
        return len(self.states)

    def velocities(self, since):
        """Return the velocities (k, nq) after `since` states."""
        states = [state for _, state in self.states[since:]]
        at = np.array([state.position for state in states])
        t = np.array([to_seconds(state.header.stamp) for state in states])
        return np.diff(at, axis=0) / np.diff(t)[:, None]

    def speed(self):
        """Return the latest speed of the fastest joint, or NaN before two states."""
        if len(self.states) < 2:
            return np.nan
        return np.abs(self.velocities(-2)).max()


def make_messages(cell, start):
    """Return the marks of each camera and the joints of a cell as messages; `start` is in ns."""
    from builtin_interfaces.msg import Time
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

    def stamp(seconds):
        at = start + round(seconds * NANO)
        return Time(sec=at // NANO, nanosec=at % NANO)

    now, marks = cell.now, {}
    joints = JointState(name=list(cell.scene.coordinate_names), position=now.measured.tolist())
    joints.header.stamp = stamp(now.time)
    for (camera, target), pixels in now.pixels.items():
        seen = np.flatnonzero(np.isfinite(pixels[:, 0]))
        dim = [MultiArrayDimension(label=f"{target}.{i}") for i in seen]
        at = stamp(now.image_time)
        data = [float(at.sec), float(at.nanosec), *pixels[seen].ravel().tolist()]
        layout = MultiArrayLayout(dim=dim, data_offset=2)
        marks[camera] = Float64MultiArray(layout=layout, data=data)
    return marks, joints


class PlayedRobot:
    """A cell in this process, in real time, with messages that a test may change.

    `change(marks, joints)` returns the joint states to publish, and may change the marks.
    """

    def __init__(self, listener, experiment):
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray

        self.listener, self.cell = listener, experiment.cell()
        self.commands = listener.hear(Float64MultiArray, COMMANDS, 100)
        cameras = dict.fromkeys(camera for camera, _ in self.cell.now.pixels)
        node = listener.node
        self.joints = node.create_publisher(JointState, JOINTS, 10)
        self.marks = {
            name: node.create_publisher(Float64MultiArray, f"/{name}/detections", 10)
            for name in cameras
        }
        self.change = lambda marks, joints: [joints]
        self.shift = 0  # nanoseconds by which the clock of the robot has leapt
        self.still = np.zeros(self.cell.columns.size)
        self.begin = 0  # number of the first command since the start
        self._closing, self._again = threading.Event(), False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        begin, clock = time.time_ns(), time.monotonic()
        while not self._closing.is_set():
            self._publish(begin + self.shift)
            wait = clock + (self.cell.now.step + 1) * self.cell.dt - time.monotonic()
            self._closing.wait(max(wait, 0.0))
            self.cell.advance(self.command())
            if self._again:
                begin, clock, self.begin = time.time_ns(), time.monotonic(), len(self.commands)
                self.cell.reset()
                self._again = False

    def _publish(self, start):
        marks, joints = make_messages(self.cell, start)
        states = self.change(marks, joints)
        if self.cell.now.arrived:
            for name, message in marks.items():
                self.marks[name].publish(message)
        for each in states:
            self.joints.publish(each)

    def command(self):
        """Return the latest command (n,), zero before the first."""
        new = self.commands[self.begin :]
        return np.array(new[-1][1].data) if new else self.still

    def moves(self):
        """Return whether the robot is commanded to move."""
        return np.abs(self.command()).max() > MOVES

    def wait_for_motion(self, deadline=DEADLINE):
        """Wait until the robot is commanded to move."""
        wait_until(self.moves, "motion", deadline)

    def wait_for_rest(self, deadline=5.0):
        """Wait until commands are zero, and return the commands (k, n) on the way there."""
        since = len(self.commands) - 1
        wait_until(lambda: not self.command().any(), "rest", deadline)
        return self.commands_since(since)

    def commands_since(self, count):
        """Return the commands (k, n) after `count` others."""
        return np.array([message.data for _, message in self.commands[count:]])

    def restart(self):
        """Return to the start, with unchanged messages."""
        self.change, self._again = lambda marks, joints: [joints], True
        wait_until(lambda: not self._again, "restart")

    def close(self):
        """Stop publishing."""
        self._closing.set()
        self._thread.join()
