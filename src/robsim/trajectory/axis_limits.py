"""Limits of speed and acceleration of each axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_one_or_each
from robsim.base.errors import InputError
from robsim.declare.joint_numbers import OneOrEach, PerJoint, get_followed_axes

PerAxis = float | tuple[float, ...]  # one number for all axes, or one for each axis
SPEEDS = OneOrEach(get_followed_axes, "/s")
ACCELERATIONS = OneOrEach(get_followed_axes, "/s^2")
AxisSpeed = Annotated[PerAxis | None, SPEEDS, "Largest speed of each axis."]
AxisAcceleration = Annotated[PerAxis | None, ACCELERATIONS, "Largest acceleration of each axis."]
AXIS_COORDINATES = PerJoint(get_followed_axes)


@dataclass(frozen=True)
class Limits:
    """Limits of the speed and the acceleration of axes.

    A limit is one positive number for all axes, or one number for each axis.

    Attributes
    ----------
    speed : float or tuple of float
        Largest speed, in rad/s or m/s.
    acceleration : float or tuple of float
        Largest acceleration, in rad/s^2 or m/s^2.

    Examples
    --------
    >>> Limits(1.0, [2, 3]).of(2)
    (array([1., 1.]), array([2., 3.]))
    """

    speed: Annotated[PerAxis, SPEEDS, "Largest speed of each axis."]
    acceleration: Annotated[PerAxis, ACCELERATIONS, "Largest acceleration of each axis."]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, speed: ArrayLike | None, acceleration: ArrayLike | None) -> None: ...

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration"):
            object.__setattr__(self, name, check_per_axis(getattr(self, name), name))

    def of(self, axes: int) -> tuple[Array, Array]:
        """Return speed and acceleration limits (axes,); raise InputError if the count differs."""
        return expand_per_axis(self.speed, "speed", axes), expand_per_axis(
            self.acceleration, "acceleration", axes
        )


def check_per_axis(value: ArrayLike | None, what: str) -> PerAxis:
    """Return one or several positive numbers; raise an InputError that names `what` for others."""
    if value is None:
        raise InputError(f"{what}: expected a positive number, or one for each axis, got None")
    return as_one_or_each(value, what, "axis")


def expand_per_axis(value: PerAxis, what: str, axes: int) -> Array:
    """Return numbers (axes,), one for each axis; raise InputError if the count differs."""
    if isinstance(value, tuple) and len(value) != axes:
        raise InputError(f"{what}: {len(value)} numbers for {axes} axes")
    return np.full(axes, value, dtype=float)
