"""The topics of a bag, and what each of them holds."""

from __future__ import annotations

from collections.abc import Mapping

from robsim.base.errors import FileError, InputError, said, suggest
from robsim.logs import messages

JOINTS, COMMANDS, EXPERIMENT = "/joint_states", "/joint_commands", "/robsim/experiment"
FRAMES, STILL = "/tf", "/tf_static"
TYPES = {
    "joints": (messages.JOINTS,),
    "commands": (messages.JOINTS, messages.NUMBERS, messages.TRAJECTORY, *messages.TWISTS),
    "marks": (messages.DETECTIONS, messages.APRILTAGS),
    "lens": (messages.LENS,),
    "experiment": (messages.TEXT,),
    "images": (messages.COMPRESSED,),
}
NEEDED = ("joints", "marks")


def of_camera(name: str, what: str) -> str:
    """Return the topic of a camera's marks or lens.

    >>> of_camera("left-eye", "detections")
    '/left_eye/detections'
    """
    return f"/{name.replace('-', '_')}/{what}"


def defaults(cameras: tuple[str, ...]) -> dict[str, str]:
    """Return the topic of each role: joints, commands, and marks and lens of each camera."""
    return {
        "joints": JOINTS,
        "commands": COMMANDS,
        **{f"marks.{name}": of_camera(name, "detections") for name in cameras},
        **{f"lens.{name}": of_camera(name, "camera_info") for name in cameras},
    }


def chosen(
    found: Mapping[str, str], cameras: tuple[str, ...], given: Mapping[str, str] | None
) -> dict[str, str]:
    """Return the topic of each role that is in a bag, of {topic: type} in it.

    FileError: one is not there, or of another type; InputError: a role that does not exist.
    """
    usual = defaults(cameras)
    wanted = _roles(usual, cameras, {} if given is None else given)
    roles = {}
    for role, topic in usual.items():
        types = TYPES[role.partition(".")[0]]
        alone = role != "commands" and ("." not in role or len(cameras) == 1)
        name = wanted.get(role) or _guess(found, topic, types if alone else ())
        if name is not None:
            check_topic(found, name, types)
            roles[role] = name
        elif role.partition(".")[0] in NEEDED:
            raise FileError(
                f"no topic {topic} ({' or '.join(types)}); which is it? topics={{'{role}': ...}}; "
                f"{suggest(topic, sorted(found), 'topics')}"
            )
    return roles


def _roles(
    usual: Mapping[str, str], cameras: tuple[str, ...], given: Mapping[str, str]
) -> dict[str, str]:
    """Return the topics that are given by role; those of the only camera need no name."""
    if not isinstance(given, Mapping):
        raise InputError(f"topics: expected {{role: topic}}, got {said(given)}")
    short = {f"{of}": f"{of}.{cameras[0]}" for of in ("marks", "lens") if len(cameras) == 1}
    roles = {}
    for role, topic in given.items():
        name = short.get(role, role) if isinstance(role, str) else role
        if name not in usual or not isinstance(topic, str):
            raise InputError(f"topics: no {said(role)}; {suggest(role, usual, 'topics')}")
        roles[name] = topic
    return roles


def _guess(found: Mapping[str, str], usual: str, types: tuple[str, ...]) -> str | None:
    """Return the usual topic, or the only one of some types if that is not there."""
    if usual in found:
        return usual
    alike = [name for name, kind in found.items() if kind in types]
    return alike[0] if len(alike) == 1 else None


def check_topic(found: Mapping[str, str], name: str, types: tuple[str, ...]) -> None:
    """Raise FileError unless a bag has a topic of one of some types."""
    if name not in found:
        raise FileError(f"no topic {name}; {suggest(name, sorted(found), 'topics')}")
    if found[name] not in types:
        raise FileError(f"topic {name} holds {found[name]}; expected {' or '.join(types)}")
