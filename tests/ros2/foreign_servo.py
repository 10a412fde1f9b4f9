"""Image-based visual servoing of a Puma 560, written without RobSim: a client of a played cell."""

from contextlib import suppress

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

JOINTS = ("shoulder", "upper_arm", "forearm", "wrist_roll", "wrist_bend", "flange")
D, A = (0.67183, 0, 0.15005, 0.4318, 0, 0), (0, 0.4318, 0.0203, 0, 0, 0)  # Denavit-Hartenberg
ALPHA = np.radians([90, 0, -90, 90, -90, 0])
FOCAL, CENTRE, GAIN, DEPTH = 500.0, (319.5, 239.5), 0.8, 0.5
LAST = [0, 0, 0, 1]
GOAL = np.array([[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]])


def camera_jacobian(q):
    """Return the Jacobian (6, 6) of the flange, linear and angular, in its own axes."""
    T, axes, origins = np.eye(4), [], []
    for angle, d, a, ca, sa in zip(q, D, A, np.cos(ALPHA), np.sin(ALPHA), strict=True):
        axes.append(T[:3, 2])
        origins.append(T[:3, 3])
        c, s = np.cos(angle), np.sin(angle)
        T = T @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], LAST]
    linear = [np.cross(z, T[:3, 3] - p) for z, p in zip(axes, origins, strict=True)]
    return np.vstack([T[:3, :3].T @ np.transpose(linear), T[:3, :3].T @ np.transpose(axes)])


def interaction_matrix(points, Z):
    """Return the interaction matrix (2 N, 6) of points in the image, at one depth."""
    upper = [[-1 / Z, 0, x / Z, x * y, -1 - x * x, y] for x, y in points]
    lower = [[0, -1 / Z, y / Z, 1 + y * y, -x * y, -x] for x, y in points]
    return np.hstack([upper, lower]).reshape(-1, 6)


class Servo:
    def __init__(self, node):
        self.points, topic = GOAL, "/forward_velocity_controller/commands"  # it rests until it sees
        self.commands = node.create_publisher(Float64MultiArray, topic, 1)
        node.create_subscription(Float64MultiArray, "/eye/detections", self.on_marks, 10)
        node.create_subscription(JointState, "/joint_states", self.on_joints, 10)

    def on_marks(self, message):
        if len(message.data) == 2 + GOAL.size:  # the time of the image, and every mark
            self.points = (np.reshape(message.data[2:], (-1, 2)) - CENTRE) / FOCAL

    def on_joints(self, message):
        q = [message.position[message.name.index(name)] for name in JOINTS]
        J = interaction_matrix(GOAL, DEPTH) @ camera_jacobian(q)
        qd = -GAIN * np.linalg.pinv(J) @ (self.points - GOAL).ravel()
        self.commands.publish(Float64MultiArray(data=qd.tolist()))


rclpy.init()
servo = Servo(node := rclpy.create_node("foreign_servo"))
with suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(node)
