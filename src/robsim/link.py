"""Links: the rigid parts of a robot, each on its joint."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from robsim.errors import InputError
from robsim.joint import FIXED, Joint
from robsim.names import checked_name
from robsim.primitives import Primitive


def checked_shapes(given: Any, owner: str) -> tuple[Primitive, ...]:
    """One or several primitives as a tuple, or an InputError that names their owner."""
    shapes = (given,) if isinstance(given, Primitive) else given
    if not isinstance(shapes, Iterable) or not all(isinstance(s, Primitive) for s in shapes):
        raise InputError(f"{owner}: shapes are Block, Wheel or CameraBody, got {given!r:.80}")
    return tuple(shapes)


@dataclass(frozen=True)
class Link:
    """A rigid part: its frame hangs from the link `parent` by `joint`; `shapes` draw it.

    >>> Link("body", "base", Joint("floating")).joint.kind
    'floating'
    """

    name: str
    parent: str | None = None
    joint: Joint = FIXED
    shapes: tuple[Primitive, ...] = ()

    def __post_init__(self) -> None:
        checked_name(self.name, "link")
        if not isinstance(self.joint, Joint):
            raise InputError(f"link '{self.name}': expected a Joint, got {self.joint!r:.80}")
        object.__setattr__(self, "shapes", checked_shapes(self.shapes, f"link '{self.name}'"))


def coordinate_names(links: Iterable[Link]) -> tuple[str, ...]:
    """Of what the joints have of their own: the joint's name, or the link's, and .x or the like."""
    return tuple(
        (link.joint.name or link.name) + part
        for link in links
        for part in link.joint.parts.coordinates
    )


def velocity_names(links: Iterable[Link]) -> tuple[str, ...]:
    """Likewise of the velocities."""
    return tuple(
        (link.joint.name or link.name) + part
        for link in links
        for part in link.joint.parts.velocities
    )
