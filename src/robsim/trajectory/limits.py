"""Limits of the speed and the acceleration of each axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array, one_or_each
from robsim.base.errors import InputError
from robsim.declare.joints import OneOrEach, PerJoint, followed, per

Each = float | tuple[float, ...]  # one number for all, or one for each
SPEEDS = OneOrEach(per(followed, "/s"), "limits", ("turn rate", "speed"))
ACCELERATIONS = OneOrEach(per(followed, "/s^2"), "limits", ("turn acceleration", "acceleration"))
Speed = Annotated[Any, SPEEDS, "Largest speed of each axis."]
Acceleration = Annotated[Any, ACCELERATIONS, "Largest acceleration of each axis."]
Coordinates = PerJoint(followed)


@dataclass(frozen=True)
class Limits:
    """One positive number for all axes, or one for each, in rad/s or m/s and per second more.

    >>> Limits(1.0, [2, 3]).of(2)
    (array([1., 1.]), array([2., 3.]))
    """

    speed: Speed
    acceleration: Acceleration

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration"):
            object.__setattr__(self, name, per_axis(getattr(self, name), name))

    def of(self, axes: int) -> tuple[Array, Array]:
        """(axes,) of each; InputError unless there are as many."""
        return each(self.speed, "speed", axes), each(self.acceleration, "acceleration", axes)


def per_axis(value: Any, what: str) -> Each:
    """A positive number, or several; InputError that names `what`."""
    if value is None:
        raise InputError(f"{what}: expected a positive number, or one for each axis, got None")
    return one_or_each(value, what, "axis")


def each(value: Each, what: str, axes: int) -> Array:
    """(axes,) numbers; InputError unless there is one for all, or as many."""
    if isinstance(value, tuple) and len(value) != axes:
        raise InputError(f"{what}: {len(value)} numbers for {axes} axes")
    return np.full(axes, value, dtype=float)
