"""Frames of a tree: parents, order and coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from robsim.base.errors import FrameError, InputError, suggest_names
from robsim.declare.problems import prefix_path
from robsim.robot.joint import Joint


@dataclass(frozen=True)
class Frame:
    """Frame of a tree, connected to the frame `parent` by `joint`."""

    name: str
    parent: str
    joint: Joint

    @property
    def label(self) -> str:
        """Name of the coordinates: the name of the joint if given, else the name of the frame."""
        if self.joint.name is None:
            return self.name
        prefix, dot, _ = self.name.rpartition(".")
        return f"{prefix}{dot}{self.joint.name}"

    @property
    def coordinates(self) -> list[str]:
        """Names of the independent coordinates of the frame."""
        return [self.label + part for part in self.joint.parts.coordinates]


def is_steering_angle(owner: Frame, name: str) -> bool:
    """Return whether a coordinate of this frame is a steering angle.

    The frame is checked as well as the name, because a link may also have the name "steering".
    """
    return owner.joint.steering is not None and name.endswith(".steering")


def check_coupling_source(frame: Frame, owners: dict[str, Frame]) -> None:
    """Raise InputError if the source of a coupled frame does not exist or is not suitable."""
    follows = frame.joint.follows
    name: str = follows.of  # type: ignore[union-attr]
    if name not in owners:
        hint = suggest_names(name, owners, "coordinates")
        raise InputError(f"'{frame.name}' follows '{name}', which does not exist; {hint}")
    assert follows is not None
    if not follows.fits(owners[name].joint, is_steering_angle(owners[name], name)):
        raise InputError(f"'{frame.name}' must follow {follows.wanted}, which '{name}' is not")


def sort_coupled_frames(tied: list[Frame]) -> list[Frame]:
    """Return the coupled frames, each after its source, or raise InputError for a loop.

    Sources that do not exist are reported elsewhere.
    """
    by_label = {frame.label: frame for frame in tied}
    sources = {frame.label: [frame.joint.follows.of] for frame in tied}  # type: ignore[union-attr]
    try:
        order = list(TopologicalSorter(sources).static_order())
    except CycleError as error:
        raise InputError(f"'{error.args[1][0]}' follows itself") from None
    return [by_label[label] for label in order if label in by_label]


def sort_parents_first(frames: list[Frame]) -> list[Frame]:
    """Return the same frames, each after its parent."""
    number = {frame.name: i for i, frame in enumerate(frames)}
    children: dict[str, list[int]] = {}
    for i, frame in enumerate(frames):
        children.setdefault(frame.parent, []).append(i)
    order: list[int] = []
    layer = children.pop("world", [])
    while layer:
        order += layer
        layer = sorted(i for k in layer for i in children.pop(frames[k].name, []))
    if children:
        orphan = frames[min(i for some in children.values() for i in some)]
        with prefix_path(orphan.name):
            if orphan.parent in number:
                raise FrameError(f"'{orphan.name}' is its own ancestor, through '{orphan.parent}'")
            raise FrameError(
                f"'{orphan.name}' stands on '{orphan.parent}', and there is no such frame; "
                f"{suggest_names(orphan.parent, ['world', *number], 'frames')}"
            )
    return [frames[i] for i in order]
