"""The frames of a scene, and what they hang from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from robsim.base.errors import FrameError, suggest
from robsim.geometry.pose import Pose
from robsim.robot.assembly import Frame
from robsim.robot.joint import FIXED, Joint
from robsim.robot.robot import Robot
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object


def frames_of(
    robots: Iterable[Robot], objects: Iterable[Object], cameras: Iterable[MountedCamera]
) -> list[Frame]:
    """Return the links of all robots, "robot.link", then objects and cameras by name."""
    frames = []
    for robot in robots:
        for i, link in enumerate(robot.links):
            joint = link.joint.within(robot.name)
            if not i:
                joint = _fixed(robot.base @ link.joint.place @ link.joint.tail)
            parent = f"{robot.name}.{link.parent}" if i else robot.on
            frames.append(Frame(f"{robot.name}.{link.name}", parent, joint))
    hung: tuple[Object | MountedCamera, ...] = (*objects, *cameras)
    for part in hung:
        frames.append(Frame(part.name, part.on, _fixed(part.pose)))
    return frames


def check_hanging(frames: Sequence[Frame], thing: Object, to: Any) -> None:
    """Raise FrameError if there is no frame `to`, or if it hangs from the object itself."""
    above = {frame.name: frame.parent for frame in frames}
    known = ["world", *above]
    if not isinstance(to, str) or to not in known:
        raise FrameError(f"no frame {to!r:.80}; {suggest(to, known, 'frames')}")
    frame = to
    while frame != "world":
        if frame == thing.name:
            way = "itself" if to == frame else f"'{to}', which stands on it"
            raise FrameError(f"'{thing.name}' cannot hang from {way}")
        frame = above[frame]


def _fixed(pose: Pose) -> Joint:
    return replace(FIXED, place=pose)
