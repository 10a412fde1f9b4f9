"""The frames of a scene and their parents."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from robsim.base.errors import FrameError, format_value, suggest_names
from robsim.base.value import replace_unchecked
from robsim.declare.context import Context
from robsim.geometry.pose import Pose
from robsim.robot.frame import Frame
from robsim.robot.joint import FIXED, Joint
from robsim.robot.robot import Robot
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object

MOST_LINKS = 1024  # total over all robots of a scene


def list_scene_frames(
    robots: Iterable[Robot], objects: Iterable[Object], cameras: Iterable[MountedCamera]
) -> list[Frame]:
    """Return the frames of all robots as "robot.link", then the frames of objects and cameras."""
    frames = []
    for robot in robots:
        for i, link in enumerate(robot.links):
            joint = link.joint.with_prefix(robot.name)
            if not i:
                joint = _fixed_joint(robot.base @ link.joint.place @ link.joint.tail)
            parent = f"{robot.name}.{link.parent}" if i else robot.on
            frames.append(Frame(f"{robot.name}.{link.name}", parent, joint))
    attached: tuple[Object | MountedCamera, ...] = (*objects, *cameras)
    for part in attached:
        frames.append(Frame(part.name, part.on, _fixed_joint(part.pose)))
    return frames


def check_attachment(frames: Sequence[Frame], thing: Object, to: object) -> None:
    """Raise FrameError if the frame `to` does not exist, or if the object itself carries it."""
    above = {frame.name: frame.parent for frame in frames}
    known = ["world", *above]
    if not isinstance(to, str) or to not in known:
        raise FrameError(f"no frame {format_value(to)}; {suggest_names(to, known, 'frames')}")
    frame = to
    while frame != "world":
        if frame == thing.name:
            carrier = "itself" if to == frame else f"'{to}', which stands on it"
            raise FrameError(f"'{thing.name}' cannot hang from {carrier}")
        frame = above[frame]


def _fixed_joint(pose: Pose) -> Joint:
    """Return a fixed joint with a pose."""
    return replace_unchecked(FIXED, place=pose)


def report_unknown_frames(raw: Mapping[str, object], parts: Mapping[str, Any], c: Context) -> None:
    """Report parts on a frame that does not exist, at their keys in the text."""
    if any(kind in raw and kind not in parts for kind in ("robots", "objects", "cameras")):
        return  # those parts are reported elsewhere
    robots = parts.get("robots", ())
    frames = ["world", *(f"{robot.name}.{link.name}" for robot in robots for link in robot.links)]
    if len(frames) > MOST_LINKS:
        c.at("robots").report(f"more than {MOST_LINKS} links in all")
        return
    others = [*parts.get("objects", ()), *parts.get("cameras", ())]
    frames += [part.name for part in others]
    for kind in ("robots", "objects", "cameras"):
        for part in parts.get(kind, ()):
            if part.on not in frames:
                hint = suggest_names(part.on, frames, "frames")
                c.at(kind, part.name, "on").report(f"no frame {part.on!r}; {hint}")
