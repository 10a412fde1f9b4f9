"""Fastest motions within limits of speed and acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.declare import register
from robsim.declare.context import Context
from robsim.trajectory.axis_limits import AxisAcceleration, AxisSpeed, Limits
from robsim.trajectory.rest_to_rest import END_COORDINATES, RestToRest
from robsim.trajectory.time_law import Timing


@dataclass(frozen=True)
class TrapezoidTable:
    """Text form of a motion within limits."""

    start: Annotated[Array, END_COORDINATES, "Coordinates of the axes at the start."]
    end: Annotated[Array, END_COORDINATES, "Coordinates of the axes at the end."]
    speed: AxisSpeed
    acceleration: AxisAcceleration

    def build_value(self, c: Context) -> Trapezoid:
        """Return the motion that the table describes."""
        return Trapezoid(**vars(self))

    @classmethod
    def of(cls, value: Trapezoid, c: Context) -> TrapezoidTable:
        """Return the table that describes a motion."""
        return cls(value.start, value.end, value.limits.speed, value.limits.acceleration)


@register("trajectory", "trapezoid")
@dataclass(frozen=True, eq=False, init=False)
class Trapezoid(RestToRest):
    """Fastest motion from rest to rest within limits of speed and acceleration.

    Each axis accelerates, moves at constant speed and decelerates; over a short distance it never
    reaches its speed limit (Siciliano et al. 2009, section 4.2.1). The slowest axis determines the
    duration, and all other axes are slowed down to this duration. Use it for fast motions, and
    `Quintic` for smooth motions of a given duration.

    The keyword arguments `speed` (rad/s or m/s) and `acceleration` (rad/s^2 or m/s^2) are the
    limits: a number for all axes, or an array (n,). Leading axes (...) of `start` and `end`
    describe several motions at once, which are broadcast against the times.

    Attributes
    ----------
    limits : Limits
        Limits of speed and acceleration.

    Raises
    ------
    InputError
        If `start` and `end` do not have the same number of axes, or a limit is not positive or does
        not have one number for each axis.

    Examples
    --------
    >>> move = Trapezoid([0.0, 0.0], [2.0, 0.1], speed=1.0, acceleration=2.0)
    >>> move.duration, move.at(0.5).round(12), move.velocity(1.0).round(12)
    (2.5, array([0.25 , 0.008]), array([1.   , 0.064]))
    """

    limits: Limits
    text_form: ClassVar[type[Any]] = TrapezoidTable

    def __init__(
        self, start: ArrayLike, end: ArrayLike, *, speed: ArrayLike, acceleration: ArrayLike
    ):
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "end", end)
        object.__setattr__(self, "limits", Limits(speed, acceleration))
        super().__post_init__()
        self.limits.of(self.start.shape[-1])

    @property
    def duration(self) -> float | Array:
        """Duration in seconds, (...) for several motions."""
        seconds = self.timing.seconds
        return seconds if seconds.ndim else float(seconds)

    @cached_property
    def timing(self) -> Timing:
        """Timing of the motion."""
        distance: Array = np.abs(self.end - self.start)
        return Timing.shortest(distance, *self.limits.of(distance.shape[-1]))
