"""A ROS 2 node that drives a robot by an experiment: `python ros2_node.py --ros-args -p ...`.

It subscribes to joints and marks, and answers each joint state with a command. Parameters:

scenario    path of the experiment
joints      topic of sensor_msgs/JointState
marks       topic of the marks; with several cameras, CAMERA in it is replaced by each name
seen        type of the marks: also apriltag_msgs/msg/AprilTagDetectionArray
commands    topic of the commands
kind        their type: also trajectory_msgs/msg/JointTrajectory, geometry_msgs/msg/Twist, ...
names       "JOINT=NAME" for joints with other names in the messages
ids         "TARGET=ID,ID,..." for marks with other names than TARGET.NUMBER
frames      "LINK=FRAME" and "world=FRAME" for a base or camera with a pose in /tf only
order       joints of a command in the order of the robot's controller, by their message names
run         topic of std_msgs/Bool, which must be true and recent if safety has hold_to_run
patience    seconds without joints until the node stops the robot

Limits, and the reaction to missing images, are in [safety] of the scenario.
"""

import sys
import time

import robsim as rs

PARAMETERS = {
    "scenario": "",
    "joints": "/joint_states",
    "marks": "/CAMERA/detections",
    "seen": "vision_msgs/msg/Detection2DArray",
    "commands": "/forward_velocity_controller/commands",
    "kind": "std_msgs/msg/Float64MultiArray",
    "names": [""],  # rclpy has no type for an empty list
    "ids": [""],
    "frames": [""],
    "order": [""],
    "run": "/robsim/run",
    "patience": 0.1,
}
HOLDS = 0.2  # seconds for which a permission to run is valid
FRAMES = 100  # queue length of /tf: each message may contain other frames
QUEUE = 1  # queue length of commands: only the latest command is useful


def pairs(texts):
    """Return the dictionary of texts "KEY=VALUE"."""
    return dict(text.split("=", 1) for text in texts if text)


def maker(type_of):
    """Return a function that makes a message of a type; rclpy accepts no NumPy arrays as fields."""

    def make(kind, **fields):
        plain = {k: v.tolist() if hasattr(v, "tolist") else v for k, v in fields.items()}
        return type_of(kind)(**plain)

    return make


class Servo:
    """A controller between the topics of a node.

    `type_of` returns the message type of a name, `queue` is the QoS of subscriptions, and
    `latched` the QoS of messages that were published before.
    """

    def __init__(self, node, type_of, queue, latched):
        self.node = node
        self.told = {name: node.declare_parameter(name, v).value for name, v in PARAMETERS.items()}
        self.controller = rs.Controller.from_file(self.told["scenario"])
        ids = {target: each.split(",") for target, each in pairs(self.told["ids"]).items()}
        self.ros = rs.control.RosMessages(
            self.controller,
            names=pairs(self.told["names"]),
            marks=ids,
            frames=pairs(self.told["frames"]),
            order=[name for name in self.told["order"] if name] or None,
            make=maker(type_of),
        )
        self.images, self.heard, self.released, self.phase = {}, None, -HOLDS, ""
        self._listen(type_of, queue)
        if self.ros.roams:
            frames = type_of("tf2_msgs/msg/TFMessage")
            node.create_subscription(frames, "/tf_static", self.on_still, latched)
            node.create_subscription(frames, "/tf", self.on_frames, FRAMES)

    def _listen(self, type_of, queue):
        node, told = self.node, self.told
        self.publisher = node.create_publisher(type_of(told["kind"]), told["commands"], QUEUE)
        joints, run = type_of("sensor_msgs/msg/JointState"), type_of("std_msgs/msg/Bool")
        node.create_subscription(joints, told["joints"], self.on_joints, queue)
        node.create_subscription(run, told["run"], self.on_run, queue)
        for name in self.controller.cameras:
            topic = told["marks"].replace("CAMERA", name)
            hear = lambda message, name=name: self.on_marks(message, name)  # noqa: E731
            node.create_subscription(type_of(told["seen"]), topic, hear, queue)
        node.create_timer(told["patience"] / 2, self.watch)

    def on_marks(self, message, camera):
        """Store the marks of a camera until the next command."""
        try:
            self.images[camera] = self.ros.marks(message, camera, t=self._now())
        except rs.errors.InputError as error:
            self.node.get_logger().warning(str(error))

    def on_run(self, message):
        """Store the message that permits or forbids motion."""
        self.released = time.monotonic() if message.data else -HOLDS

    def on_joints(self, message):
        """Answer a joint state with a command."""
        self._on(self.ros.joints, message)

    def on_frames(self, message):
        """Answer the pose of a base or a camera with a command."""
        self._on(self.ros.frames, message)

    def on_still(self, message):
        """Store the transforms of static frames."""
        self._on(lambda each: self.ros.frames(each, still=True), message)

    def _on(self, read, message):
        try:
            q = read(message)
            if q is not None:
                self._answer(q, self.ros.time(message) or self._now())
        except rs.errors.InputError as error:  # does not fit the scene, or is not finite
            self.node.get_logger().error(str(error))

    def _answer(self, q, t):
        run = True if time.monotonic() - self.released < HOLDS else None
        images, self.images = self.images, {}
        command = self.controller.step(images or None, q, t, run=run)
        self._tell(command.velocities)
        self.heard = time.monotonic()
        if (command.phase, command.health.fault) != self.phase:
            self.phase = command.phase, command.health.fault
            self.node.get_logger().info(" ".join(self.phase))

    def _tell(self, velocities):
        self.publisher.publish(self.ros.command(velocities, self.told["kind"]))

    def _now(self):
        return self.node.get_clock().now().nanoseconds * 1e-9

    def watch(self):
        """Stop the robot if no joints have arrived for `patience`."""
        if self.heard is not None and time.monotonic() - self.heard > self.told["patience"]:
            self.stop()

    def stop(self):
        """Command zero velocities."""
        self.heard = None
        self._tell([0.0] * len(self.controller.velocity_names))


def main():
    """Run the node until it is stopped."""
    try:
        import rclpy
        from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
        from rclpy.signals import SignalHandlerOptions
        from rosidl_runtime_py.utilities import get_message
    except ImportError:
        sys.exit("needs ROS 2: source /opt/ros/DISTRO/setup.bash")
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # main sends a stop at the end
    latched = QoSProfile(depth=FRAMES, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node = rclpy.create_node("robsim")
    servo = Servo(node, get_message, qos_profile_sensor_data, latched)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        servo.stop()
        rclpy.shutdown()


if __name__ == "__main__":
    main()
