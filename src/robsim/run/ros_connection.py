"""The connection of an experiment to ROS 2: topics, types and names of messages, and times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from robsim.base.errors import check_known
from robsim.declare import DeclaredValue, ListOf, Role, Table, Text, Time, Word, described
from robsim.declare.texts import NameTable
from robsim.world.scene import Scene

TOPIC = Text(most=255, least=1, pattern=r"~?/?[A-Za-z_][A-Za-z0-9_/]*")
COMMAND_TYPES = (
    "std_msgs/msg/Float64MultiArray",
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/JointTrajectory",
    "geometry_msgs/msg/Twist",
    "geometry_msgs/msg/TwistStamped",
)
MARK_TYPES = (
    "vision_msgs/msg/Detection2DArray",
    "std_msgs/msg/Float64MultiArray",
    "apriltag_msgs/msg/AprilTagDetectionArray",
)
CAMERA, ROBOT = "CAMERA", "ROBOT"  # parts of a topic that are replaced by a name


@described
@dataclass(frozen=True)
class RosConnection(DeclaredValue):
    """Topics, types and names of the ROS 2 messages of an experiment, and their longest gaps.

    Both `robsim ros2 play` and `robsim ros2 drive` use the connection, so they fit each other. In
    topics, CAMERA stands for the name of each camera, and ROBOT for the name of each robot. A
    connection has no effect on a simulated run.

    Raises
    ------
    InputError
        If a field is not valid; by an experiment, if the scene has no such joint, target or frame.

    Examples
    --------
    >>> connection = RosConnection(names={"shoulder": "shoulder_pan_joint"})
    >>> dict(connection.names), connection.name_topic("marks", camera="eye")
    ({'shoulder': 'shoulder_pan_joint'}, '/eye/detections')
    """

    joints: Annotated[str, TOPIC, Role.MESSAGE, "Topic of the joint states."] = "/joint_states"
    marks: Annotated[str, TOPIC, Role.MESSAGE, "Topic of the marks of each camera."] = (
        "/CAMERA/detections"
    )
    images: Annotated[str, TOPIC, Role.MESSAGE, "Topic of the pictures of each camera."] = (
        "/CAMERA/image_raw"
    )
    commands: Annotated[str, TOPIC, Role.MESSAGE, "Topic of the commands."] = (
        "/forward_velocity_controller/commands"
    )
    command_type: Annotated[
        str, Word(COMMAND_TYPES, "message type"), Role.MESSAGE, "Type of the commands."
    ] = COMMAND_TYPES[0]
    marks_type: Annotated[
        str,
        Word(MARK_TYPES, "message type"),
        Role.MESSAGE,
        "Type of the marks. Without vision_msgs a Detection2DArray is a Float64MultiArray.",
    ] = MARK_TYPES[0]
    odometry: Annotated[
        str, TOPIC, Role.MESSAGE, "Topic of the odometry of a mobile base, or of each one."
    ] = "/odom"
    run: Annotated[
        str, TOPIC, Role.MESSAGE, "Topic of the permission to move, for `safety.hold_to_run`."
    ] = "/robsim/run"
    names: Annotated[
        Mapping[str, str] | tuple[tuple[str, str], ...],
        NameTable(),
        Role.MESSAGE,
        "Names of joints in messages, {joint: name}, if they differ.",
    ] = ()
    ids: Annotated[
        Mapping[str, Sequence[str]] | tuple[tuple[str, Sequence[str]], ...],
        NameTable(several=True),
        Role.MESSAGE,
        "Ids of marks in messages, {target: ids}. Default: TARGET.NUMBER.",
    ] = ()
    frames: Annotated[
        Mapping[str, str] | tuple[tuple[str, str], ...],
        NameTable(),
        Role.MESSAGE,
        "Names of frames in messages, {frame: name}, if they differ.",
    ] = ()
    order: Annotated[
        Sequence[str],
        ListOf(Text(most=129, least=1)),
        Role.MESSAGE,
        "Joints of a command by their names in messages, in the order of the robot's controller. "
        "Default: the order of the scene.",
    ] = ()
    patience: Annotated[
        float, Time(above=0), Role.MESSAGE, "Time without joints after which the controller stops."
    ] = 0.1
    timeout: Annotated[
        float,
        Time(above=0),
        Role.MESSAGE,
        "Time without commands after which a played robot stops.",
    ] = 0.5

    def name_topic(self, field: str, *, camera: str = "", robot: str = "") -> str:
        """Return the topic of a field for a camera or a robot.

        Parameters
        ----------
        field : str
            Field of the connection, such as "marks".
        camera, robot : str, optional
            Names that replace CAMERA and ROBOT.

        Returns
        -------
        str
            Topic.
        """
        topic: str = getattr(self, field)
        for part, name in ((CAMERA, camera), (ROBOT, robot)):
            topic = topic.replace(part, name.replace("-", "_"))
        return topic

    def check(self, scene: Scene) -> None:
        """Raise InputError if a name is not one of a joint, target or frame of a scene."""
        joints = sorted({*scene.coordinate_names, *scene.velocity_names})
        frames = list(scene.tree.where)
        for field, no, known, things in (
            ("names", "no joint {}", joints, "joints"),
            ("ids", "no target {}", [each.name for each in scene.objects], "targets"),
            ("frames", "no frame {}", frames, "frames"),
        ):
            for name, _ in getattr(self, field):
                check_known(name, known, f"{field}: {no}", things)


ROS_TABLE = Table(RosConnection)
