"""Odometry and poses as transforms, and the topics of bodies that drive or fly."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple

from robsim.logs.tf_poses import WORLD
from robsim.robot.joints.planar_joint import PlanarKind
from robsim.run.ros_connection import ROBOT, RosConnection
from robsim.world.scene import Scene

ODOMETRY, POSE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"
POSES = "/robsim/poses/"  # the topics of poses of frames


class BodyTopic(NamedTuple):
    """The topic of a body that drives or flies.

    Attributes
    ----------
    frame : str
        Frame "ROBOT.LINK" of the body.
    topic : str
        Name of the topic.
    kind : str
        Type of its messages.
    """

    frame: str
    topic: str
    kind: str


def list_body_topics(scene: Scene, connection: RosConnection) -> list[BodyTopic]:
    """Return the topics of the bodies of a scene that drive or fly in the world.

    Odometry of several bases is on a topic for each robot, and a point in the name of a frame
    becomes a slash, as ROS requires.

    >>> import robsim as rs
    >>> scene = rs.load_scenario(rs.examples.path("unicycle_docking")).scene
    >>> [(each.topic, each.kind) for each in list_body_topics(scene, RosConnection())]
    [('/odom', 'nav_msgs/msg/Odometry')]
    """
    links = [(robot.name, link) for robot in scene.robots for link in robot.links]
    roaming = [(robot, link) for robot, link in links if link.joint.model.roams]
    topics = []
    bases = {r for r, link in roaming if _is_base(scene, f"{r}.{link.name}")}
    for robot, link in roaming:
        frame = f"{robot}.{link.name}"
        if robot in bases:
            topics.append(BodyTopic(frame, name_odometry(connection, robot, len(bases)), ODOMETRY))
        else:
            topics.append(BodyTopic(frame, POSES + frame.replace(".", "/"), POSE))
    return topics


def name_odometry(connection: RosConnection, robot: str, count: int) -> str:
    """Return the topic of the odometry of a robot, one of `count` robots that drive.

    >>> name_odometry(RosConnection(), "rover", 2)
    '/rover/odom'
    """
    several = count > 1 and ROBOT not in connection.odometry
    topic = connection.name_topic("odometry", robot=robot)
    return f"/{robot}/{topic.lstrip('/')}" if several else topic


def make_transform(message: Any, frame: str, world: str = WORLD) -> Any:
    """Return an Odometry or PoseStamped message as a TFMessage with one transform of a frame."""
    pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    header = SimpleNamespace(stamp=message.header.stamp, frame_id=world)
    motion = SimpleNamespace(translation=pose.position, rotation=pose.orientation)
    edge = SimpleNamespace(header=header, child_frame_id=frame, transform=motion)
    return SimpleNamespace(transforms=[edge])


def _is_base(scene: Scene, frame: str) -> bool:
    """Return whether a body drives on a plane."""
    body, _ = scene.tree.find(frame)
    member = next(each for each in scene.tree.members if each.body == body)
    return isinstance(member.kind, PlanarKind)
