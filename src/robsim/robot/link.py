"""The links of a robot: rigid parts, each with the joint that connects it to its parent."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

from robsim.base.errors import InputError, format_value
from robsim.base.name_check import check_name
from robsim.geometry.inertia import Inertia
from robsim.geometry.primitives import Primitive
from robsim.robot.joint import FIXED, Joint


def check_shapes(given: Any, owner: str) -> tuple[Primitive, ...]:
    """Return one or several primitives as a tuple, or raise an InputError that names the owner."""
    shapes = (given,) if isinstance(given, Primitive) else given
    if not isinstance(shapes, list | tuple) or not all(isinstance(s, Primitive) for s in shapes):
        raise InputError(f"{owner}: shapes are Block, Wheel, Ball, ..., got {format_value(given)}")
    return tuple(shapes)


@dataclass(frozen=True)
class Link:
    """A rigid part, connected to the link `parent` by `joint` and drawn by `shapes`.

    `inertia` is in the link's frame; where it is not given, the shapes may weigh something.

    >>> Link("body", "base", Joint("floating")).joint.kind
    'floating'
    """

    name: str
    parent: str | None = None
    joint: Joint = FIXED
    shapes: tuple[Primitive, ...] = ()
    inertia: Inertia | None = None

    @property
    def label(self) -> str:
        """The name of its coordinates: that of the joint, if it has one, else that of the link."""
        return self.joint.name or self.name

    def __post_init__(self) -> None:
        check_name(self.name, "link")
        if not isinstance(self.joint, Joint):
            raise InputError(
                f"link '{self.name}': expected a Joint, got {format_value(self.joint)}"
            )
        object.__setattr__(self, "shapes", check_shapes(self.shapes, f"link '{self.name}'"))
        if self.inertia is not None and not isinstance(self.inertia, Inertia):
            raise InputError(
                f"link '{self.name}': expected an Inertia, got {format_value(self.inertia)}"
            )

    @property
    def inertial(self) -> Inertia | None:
        """The given inertia, or the sum over the shapes, or None if there is no mass.

        >>> from robsim.geometry.primitives import Ball
        >>> Link("tool", shapes=(Ball(0.1, mass=2), Ball(0.1, mass=1))).inertial.mass
        3.0
        """
        if self.inertia is not None:
            return self.inertia
        parts = [shape.inertia for shape in self.shapes]
        weighed = [part for part in parts if part is not None]
        return reduce(add, weighed) if weighed else None


def list_coordinate_names(links: Iterable[Link]) -> tuple[str, ...]:
    """Return the names of the joints' own coordinates: joint or link, with a suffix like .x."""
    return tuple(link.label + part for link in links for part in link.joint.parts.coordinates)


def list_velocity_names(links: Iterable[Link]) -> tuple[str, ...]:
    """Return the names of the joints' own velocities: joint or link, with a suffix like .x."""
    return tuple(link.label + part for link in links for part in link.joint.parts.velocities)
