"""The topics of a bag: their roles, default names and types."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from robsim.base.errors import FileError, suggest_names
from robsim.logs import message_types
from robsim.logs.name_map import check_name_map
from robsim.run.ros_connection import RosConnection

JOINTS, COMMANDS, FRAMES = "/joint_states", "/joint_commands", "/tf"
STATIC_FRAMES: Final = "/tf_static"
EXPERIMENT: Final = "/robsim/experiment"
INSTANT: Final = "/robsim/instant"  # of a played cell
TYPES = {
    "joints": (message_types.JOINTS,),
    "commands": (
        message_types.JOINTS,
        message_types.NUMBERS,
        message_types.TRAJECTORY,
        *message_types.TWISTS,
    ),
    "marks": (message_types.DETECTIONS, message_types.APRILTAGS, message_types.NUMBERS),
    "lens": (message_types.LENS,),
    "experiment": (message_types.TEXT,),
    "images": (message_types.COMPRESSED,),
    "frames": (message_types.FRAMES,),
    "still": (message_types.FRAMES,),
    "pose": (message_types.ODOMETRY, message_types.POSE),
}
FRAME_ROLES = ("frames", "still")  # read if the joint states are incomplete
GUESSED_ROLES = ("joints", "marks", "lens")  # the only topic of a type has the role


def camera_topic(name: str, what: str) -> str:
    """Return the topic of the marks ("detections") or the lens ("camera_info") of a camera.

    >>> camera_topic("left-eye", "detections")
    '/left_eye/detections'
    """
    return f"/{name.replace('-', '_')}/{what}"


def pose_topic(frame: str) -> str:
    """Return the topic of the pose of a frame in the world.

    >>> pose_topic("mobile_arm.left-wheel")
    '/robsim/poses/mobile_arm/left_wheel'
    """
    return f"/robsim/poses/{frame.replace('.', '/').replace('-', '_')}"


def default_topics(
    cameras: tuple[str, ...], links: Sequence[str], connection: RosConnection
) -> dict[str, tuple[str, ...]]:
    """Return the default topics by role, each the first of them that a bag has.

    The roles are joints, commands, frames, marks and lenses of cameras, and poses of links.
    """
    marks = {name: connection.name_topic("marks", camera=name) for name in cameras}
    bases = {link: connection.name_topic("odometry", robot=link.split(".")[0]) for link in links}
    return {
        "joints": (connection.joints, JOINTS),
        "commands": (connection.commands, COMMANDS),
        "frames": (FRAMES,),
        "still": (STATIC_FRAMES,),
        **{f"marks.{name}": (marks[name], camera_topic(name, "detections")) for name in cameras},
        **{f"lens.{name}": (camera_topic(name, "camera_info"),) for name in cameras},
        **{f"pose.{link}": (bases[link], pose_topic(link)) for link in links},
    }


def choose_topics(
    bag_topics: Mapping[str, str],
    cameras: tuple[str, ...],
    name_map: Mapping[str, str] | None,
    links: Sequence[str] = (),
    connection: RosConnection | None = None,
) -> dict[str, str]:
    """Return {role: topic} for a bag with the topics {topic: type}.

    `name_map` are the topics that the user gives, by role. If `links` drive or fly, the topics of
    frames or of their poses may replace the topic of joints. FileError is raised if a topic is
    missing or has another type, InputError for an unknown role.
    """
    defaults = default_topics(cameras, links, connection or RosConnection())
    user_topics = _topics_by_role(defaults, cameras, name_map)
    posed = [topic for link in links for topic in defaults[f"pose.{link}"]]
    by_frames = bool(links) and bool(
        bag_topics.keys() & {user_topics.get("frames", FRAMES), *posed}
    )
    roles = {}
    for role, (topic, *_) in defaults.items():
        kind = role.partition(".")[0]
        by_type = kind in GUESSED_ROLES and ("." not in role or len(cameras) == 1)
        name = user_topics.get(role) or _find_topic(bag_topics, defaults, role, by_type)
        if name is not None:
            check_topic(bag_topics, name, TYPES[kind])
            roles[role] = name
        elif kind == "marks" or (kind == "joints" and not by_frames):
            raise FileError(
                f"no topic {topic} ({' or '.join(TYPES[kind])}); give its name as "
                f"topics={{'{role}': ...}}; {suggest_names(topic, sorted(bag_topics), 'topics')}"
            )
    return roles


def _topics_by_role(
    defaults: Iterable[str], cameras: tuple[str, ...], name_map: Mapping[str, str] | None
) -> dict[str, str]:
    """Return the topics of the user by role; "marks" and "lens" stand for the only camera."""
    short = {of: f"{of}.{cameras[0]}" for of in ("marks", "lens") if len(cameras) == 1}
    known = [*defaults, *short]
    roles = check_name_map(name_map, "topics", "{role: topic}", known, "no {}", "topics")
    return {short.get(role, role): topic for role, topic in roles.items()}


def _find_topic(
    bag_topics: Mapping[str, str], defaults: Mapping[str, Sequence[str]], role: str, by_type: bool
) -> str | None:
    """Return a default topic of a role, or the only topic of its types if `by_type`."""
    own = [topic for topic in defaults[role] if topic in bag_topics]
    if own:
        return own[0]
    types = set(TYPES[role.partition(".")[0]]) - {message_types.NUMBERS}  # of many meanings
    known = {name for each in defaults.values() for name in each}
    alike = [name for name, kind in bag_topics.items() if kind in types and name not in known]
    return alike[0] if by_type and len(alike) == 1 else None


def check_topic(bag_topics: Mapping[str, str], name: str, types: tuple[str, ...]) -> None:
    """Raise FileError unless a bag has a topic, with one of some types."""
    if name not in bag_topics:
        raise FileError(f"no topic {name}; {suggest_names(name, sorted(bag_topics), 'topics')}")
    if bag_topics[name] not in types:
        raise FileError(
            f"topic {name} has the type {bag_topics[name]}; expected {' or '.join(types)}"
        )
