"""The limits of speed and acceleration of each axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array, one_or_each
from robsim.base.errors import InputError
from robsim.declare.joints import OneOrEach, PerJoint, followed

Each = float | tuple[float, ...]  # one number for all, or one for each
SPEEDS = OneOrEach(followed, "/s")
ACCELERATIONS = OneOrEach(followed, "/s^2")
Speed = Annotated[Any, SPEEDS, "Largest speed of each axis."]
Acceleration = Annotated[Any, ACCELERATIONS, "Largest acceleration of each axis."]
Coordinates = PerJoint(followed)


@dataclass(frozen=True)
class Limits:
    """The limits of speed and acceleration: one positive number for all axes, or one for each.

    >>> Limits(1.0, [2, 3]).of(2)
    (array([1., 1.]), array([2., 3.]))
    """

    speed: Speed
    acceleration: Acceleration

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration"):
            object.__setattr__(self, name, per_axis(getattr(self, name), name))

    def of(self, axes: int) -> tuple[Array, Array]:
        """Return speed and acceleration limits (axes,); raise InputError if the count differs."""
        return each(self.speed, "speed", axes), each(self.acceleration, "acceleration", axes)


def per_axis(value: Any, what: str) -> Each:
    """Return one positive number or several; raise an InputError that names `what`."""
    if value is None:
        raise InputError(f"{what}: expected a positive number, or one for each axis, got None")
    return one_or_each(value, what, "axis")


def each(value: Each, what: str, axes: int) -> Array:
    """Return numbers (axes,), one for each axis; raise InputError if the count differs."""
    if isinstance(value, tuple) and len(value) != axes:
        raise InputError(f"{what}: {len(value)} numbers for {axes} axes")
    return np.full(axes, value, dtype=float)
