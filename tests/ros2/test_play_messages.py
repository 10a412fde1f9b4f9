"""The messages of a played cell: commands of each type, odometry, poses, pictures and markers."""

import signal

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from ros_cells import JOINTS, to_seconds
from ros_processes import wait_until
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import MarkerArray

import robsim as rs

START = 1.0  # seconds on the clock of a stepped cell
UNITS = np.array([1.0, 1e-9])  # seconds and nanoseconds in seconds
INSTANT, COMMANDS = "/robsim/instant", "/commands"


class SteppedCell:
    """A stepped cell in a process of its own, which takes commands of one type."""

    def __init__(self, robsim, listener, folder, experiment, kind="std_msgs/msg/Float64MultiArray"):
        told = rs.control.RosConnection(commands=COMMANDS, command_type=kind)
        self.experiment, path = experiment.with_(ros2=told), folder / "cell.toml"
        path.write_text(self.experiment.to_toml(), encoding="utf-8")
        self.listener, self.count = listener, 0
        self.instants = listener.hear(Float64MultiArray, INSTANT)
        self.play = robsim("ros2", "play", path, "--stepped")
        self.wait_for_step(0)

    def wait_for_step(self, step):
        """Wait for the instant of a step, which may be repeated."""
        at = START + step * self.experiment.dt

        def is_there():
            return self.instants and abs(self.instants[-1][1].data[:2] @ UNITS - at) < 1e-6

        wait_until(is_there, f"instant at {at} s")

    def command(self, message):
        """Move by one period with a command."""
        self.listener.publish(type(message), COMMANDS, message)
        self.count += 1
        self.wait_for_step(self.count)

    def latest(self, kind, topic, condition=lambda message: True):
        """Return the message of a topic at the present instant, which is repeated for it."""
        at = START + self.count * self.experiment.dt
        self.listener.hear(kind, topic)
        there = lambda m: abs(to_seconds(m.header.stamp) - at) < 1e-6 and condition(m)  # noqa: E731
        return self.listener.wait_for(topic, there)


def named(velocities):
    names = list(velocities)
    return JointState(name=names, velocity=list(velocities.values()))


def trajectory(velocities):
    point = JointTrajectoryPoint(velocities=list(velocities.values()))
    return JointTrajectory(joint_names=list(velocities), points=[point])


@pytest.mark.parametrize(
    ("kind", "make"),
    [("sensor_msgs/msg/JointState", named), ("trajectory_msgs/msg/JointTrajectory", trajectory)],
)
def test_joints_are_commanded_by_name(kind, make, robsim, listener, tmp_path):
    experiment = rs.load_scenario(rs.examples.path("eye_to_hand"))
    cell = SteppedCell(robsim, listener, tmp_path, experiment, kind)
    names, rates = experiment.scene.velocity_names, 0.1 * np.arange(1, 7)
    speeds = dict(reversed(list(zip(names, rates.tolist(), strict=True))))
    few, more = dict(list(speeds.items())[:5]), {**speeds, "elbow_9": 0.1}
    for wrong, reason in ((few, "without joint"), (more, "elbow_9")):
        listener.publish(type(make(speeds)), COMMANDS, make(wrong))
        cell.play.wait_for(reason)
    cell.command(make(speeds))
    state = cell.latest(JointState, JOINTS)
    assert list(state.name) == list(experiment.scene.coordinate_names)
    moved = np.array(state.position) - experiment.start
    np.testing.assert_allclose(moved, experiment.dt * rates, atol=1e-12)
    np.testing.assert_allclose(state.velocity, rates, atol=1e-12)
    assert cell.play.finish(signal.SIGINT) == 0


@pytest.mark.parametrize("stamped", [False, True])
def test_a_base_is_commanded_by_twists_and_publishes_odometry(stamped, robsim, listener, tmp_path):
    experiment = rs.load_scenario(rs.examples.path("unicycle_docking"))
    kind = "geometry_msgs/msg/TwistStamped" if stamped else "geometry_msgs/msg/Twist"
    cell, twist = SteppedCell(robsim, listener, tmp_path, experiment, kind), Twist()
    twist.linear.x, twist.angular.z = 0.3, -0.2
    cell.command(TwistStamped(twist=twist) if stamped else twist)
    odometry, own = cell.latest(Odometry, "/odom"), experiment.cell()
    expected = own.advance([0.3, -0.2]).q
    at, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
    found = [at.x, at.y, 2.0 * np.arctan2(turn.z, turn.w)]
    np.testing.assert_allclose(np.exp(1j * (found - expected)), 1.0, atol=1e-9)
    speed = odometry.twist.twist
    np.testing.assert_allclose([speed.linear.x, speed.angular.z], [0.3, -0.2], atol=1e-12)
    assert odometry.header.frame_id == "world"
    assert cell.play.finish(signal.SIGINT) == 0


def test_a_flying_camera_publishes_poses_pictures_and_markers(robsim, listener, tmp_path):
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    cell = SteppedCell(robsim, listener, tmp_path, experiment)
    eye = experiment.scene.cameras[0]
    cell.command(Float64MultiArray(data=[0.1, 0.0, 0.0, 0.0, 0.0, 0.2]))
    now = experiment.cell().advance([0.1, 0.0, 0.0, 0.0, 0.0, 0.2])
    pose = cell.latest(PoseStamped, f"/robsim/poses/{eye.name}").pose
    expected = experiment.scene.pose(eye.name, now.q).q
    at, turn = pose.position, pose.orientation
    found = np.array([at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w])
    np.testing.assert_allclose(found, expected, atol=1e-9)
    lens = cell.latest(CameraInfo, f"/{eye.name}/camera_info")
    np.testing.assert_array_equal(np.reshape(lens.k, (3, 3)), eye.camera.K)
    assert (lens.width, lens.height) == eye.camera.size
    image = cell.latest(Image, f"/{eye.name}/image_raw")
    picture = np.reshape(image.data, (image.height, image.width))
    np.testing.assert_array_equal(picture, experiment.scene.picture(now.q, camera=eye.name))
    listener.hear(MarkerArray, "/robsim/markers")
    markers = listener.wait_for("/robsim/markers").markers
    assert len({marker.id for marker in markers}) == len(markers) > 0
    listener.hear(DiagnosticArray, "/diagnostics")
    (status,) = listener.wait_for("/diagnostics").status
    assert status.name == "robsim_cell" and status.values[1].value == "stepped"
    assert cell.play.finish(signal.SIGINT) == 0


def test_parameters_and_remappings_act_on_top_of_the_scenario(robsim, listener):
    path = rs.examples.path("eye_to_hand")
    names = "names:=['shoulder=joint_1']"
    ros = ["--ros-args", "-r", "/joint_states:=/arm/states", "-p", names, "-p", "timeout:=1"]
    first = rs.load_scenario(path).scene.coordinate_names[0]
    ros[4] = names.replace("shoulder", first)
    play = robsim("ros2", "play", path, *ros)
    listener.hear(JointState, "/arm/states")
    assert listener.wait_for("/arm/states").name[0] == "joint_1"
    assert play.finish(signal.SIGTERM) == 0
    wrong = robsim("ros2", "play", path, "--ros-args", "-p", "timeout:=-1.0")
    assert wrong.finish() == 2 and "timeout" in wrong.text
