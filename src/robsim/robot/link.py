"""Links of a robot: rigid parts, each with the joint that connects it to its parent."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import TYPE_CHECKING

from robsim.base.errors import InputError, format_value
from robsim.base.name_check import check_name
from robsim.base.parameter_names import name_parameters
from robsim.geometry.inertia import Inertia
from robsim.geometry.primitives import Primitive
from robsim.robot.joint import FIXED, Joint


def check_shapes(shapes: object, owner: str) -> tuple[Primitive, ...]:
    """Return one or several primitives as a tuple, or raise an InputError that names the owner."""
    solids = (shapes,) if isinstance(shapes, Primitive) else shapes
    if not isinstance(solids, list | tuple) or not all(isinstance(s, Primitive) for s in solids):
        raise InputError(f"{owner}: shapes are Block, Wheel, Ball, ..., got {format_value(shapes)}")
    return tuple(solids)


def sum_inertias(shapes: Iterable[Primitive]) -> Inertia | None:
    """Return the sum of the inertias of solids in one frame, or None if all are massless."""
    inertias = [shape.inertia for shape in shapes if shape.inertia is not None]
    return reduce(add, inertias) if inertias else None


@name_parameters
@dataclass(frozen=True)
class Link:
    """Rigid part of a robot, connected to its parent by a joint.

    Parameters
    ----------
    name : str
        Name of the link. It becomes the frame "robot.link" of a scene.
    parent : str, optional
        Name of the parent link. Only the base link has no parent.
    joint : Joint, default a fixed joint
        Joint between the parent and the link.
    shapes : Primitive or sequence of Primitive, default none
        Solids in the frame of the link, for figures, files and distances.
    inertia : Inertia, optional
        Inertia in the frame of the link. Default: the sum over the shapes.

    Raises
    ------
    InputError
        If the name is not valid, or a part has another type.

    Examples
    --------
    >>> Link("body", "base", Joint("floating")).joint.kind
    'floating'
    """

    name: str
    parent: str | None = None
    joint: Joint = FIXED
    shapes: tuple[Primitive, ...] = ()
    inertia: Inertia | None = None

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            name: str,
            parent: str | None = None,
            joint: Joint = FIXED,
            shapes: Primitive | Sequence[Primitive] = (),
            inertia: Inertia | None = None,
        ) -> None: ...

    @property
    def label(self) -> str:
        """Name of the coordinates: the name of the joint if given, else the name of the link."""
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
        """Given inertia, or the sum over the shapes, or None if all are massless.

        Examples
        --------
        >>> from robsim.geometry.primitives import Ball
        >>> Link("tool", shapes=(Ball(0.1, mass=2), Ball(0.1, mass=1))).inertial.mass
        3.0
        """
        if self.inertia is not None:
            return self.inertia
        return sum_inertias(self.shapes)


def list_coordinate_names(links: Iterable[Link]) -> tuple[str, ...]:
    """Return the names of independent coordinates: joint or link, with a suffix such as ".x"."""
    return tuple(link.label + part for link in links for part in link.joint.parts.coordinates)


def list_velocity_names(links: Iterable[Link]) -> tuple[str, ...]:
    """Return the names of independent velocities: joint or link, with a suffix such as ".x"."""
    return tuple(link.label + part for link in links for part in link.joint.parts.velocities)
