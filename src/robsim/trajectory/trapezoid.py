"""The shortest motions under limits of speed and acceleration."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import check_fields, register
from robsim.trajectory.limits import Acceleration, Limits, Speed
from robsim.trajectory.rest_to_rest import RestToRest
from robsim.trajectory.timing import Timing


@register("trajectory", "trapezoid")
@dataclass(frozen=True, eq=False)
class Trapezoid(RestToRest):
    """The shortest motion from rest to rest in which no axis exceeds its limits.

    Each axis speeds up, goes on at constant speed, and slows down; where its way is short, it never
    reaches its limit of speed (Siciliano et al. 2009, section 4.2.1). The slowest axis sets the
    time, to which the motion of every other one is stretched.

    >>> move = Trapezoid([0.0, 0.0], [2.0, 0.1], speed=1.0, acceleration=2.0)
    >>> move.duration, move.at(0.5).round(12), move.velocity(1.0).round(12)
    (2.5, array([0.25 , 0.008]), array([1.   , 0.064]))
    """

    _: KW_ONLY
    speed: Speed
    acceleration: Acceleration

    def __post_init__(self) -> None:
        super().__post_init__()
        check_fields(self)
        self.limits.of(self.start.shape[-1])

    @cached_property
    def limits(self) -> Limits:
        """The limits of all axes."""
        return Limits(self.speed, self.acceleration)

    @property
    def duration(self) -> Any:
        """Seconds; of several motions (...)."""
        seconds = self.timing.seconds
        return seconds if seconds.ndim else float(seconds)

    @cached_property
    def timing(self) -> Timing:
        """When which share of the way is done."""
        way: Array = np.abs(self.end - self.start)
        return Timing.shortest(way, *self.limits.of(way.shape[-1]))
