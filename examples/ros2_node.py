"""A ROS 2 node that lets an experiment drive a robot: `python ros2_node.py --ros-args -p ...`.

It listens to joints and marks, and answers each state of the joints with a command. Parameters:

scenario    path of the experiment
joints      topic of sensor_msgs/JointState
marks       topic of the marks; with several cameras, CAMERA in it stands for the name of each
seen        type of the marks: also apriltag_msgs/msg/AprilTagDetectionArray
commands    topic of what the robot is told
kind        its type: also trajectory_msgs/msg/JointTrajectory, geometry_msgs/msg/Twist, ...
names       "JOINT=NAME" for joints that the messages call otherwise
ids         "TARGET=ID,ID,..." for marks that they call otherwise than TARGET.NUMBER
frames      "LINK=FRAME" and "world=FRAME" of a base or camera of which only /tf says where it is
order       joints in a command as the robot's controller has them, by their names in messages
run         topic of std_msgs/Bool, which must be true and new where safety has hold_to_run
patience    seconds without joints after which the robot is told to stop

Limits, and what is done without images, are those of [safety] in the scenario.
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
HOLDS = 0.2  # seconds, for which the word to run holds
FRAMES = 100  # messages of /tf, each of which may say something else
QUEUE = 1  # of what is published: an older command is worth nothing


def pairs(texts):
    """The keys and values of some "KEY=VALUE"."""
    return dict(text.split("=", 1) for text in texts if text)


def maker(type_of):
    """What makes a message of a type and its fields, which for rclpy are no arrays of NumPy."""

    def make(kind, **fields):
        plain = {k: v.tolist() if hasattr(v, "tolist") else v for k, v in fields.items()}
        return type_of(kind)(**plain)

    return make


class Servo:
    """A controller between the topics of a node.

    `type_of` returns the type of messages of a name, `queue` is what subscriptions are made with,
    `latched` that of what was said before.
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
        """Keep what a camera saw until the next command."""
        try:
            self.images[camera] = self.ros.marks(message, camera, t=self._now())
        except rs.errors.InputError as error:
            self.node.get_logger().warning(str(error))

    def on_run(self, message):
        """Note that the robot may move, or may not."""
        self.released = time.monotonic() if message.data else -HOLDS

    def on_joints(self, message):
        """Answer a state of the joints with a command."""
        self._on(self.ros.joints, message)

    def on_frames(self, message):
        """Answer where a base or a camera is with a command."""
        self._on(self.ros.frames, message)

    def on_still(self, message):
        """Note frames that do not move."""
        self._on(lambda each: self.ros.frames(each, still=True), message)

    def _on(self, read, message):
        try:
            q = read(message)
            if q is not None:
                self._answer(q, self.ros.time(message) or self._now())
        except rs.errors.InputError as error:  # what does not fit the scene, or is no number
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
        """Stop the robot where joints have not come for a while."""
        if self.heard is not None and time.monotonic() - self.heard > self.told["patience"]:
            self.stop()

    def stop(self):
        """Tell the robot to stand still."""
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
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # the last word is a stop
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
