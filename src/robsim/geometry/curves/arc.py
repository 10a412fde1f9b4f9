"""A part of a circle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robsim.base.arrays import Array, frozen, numbers, positive
from robsim.base.errors import InputError
from robsim.geometry.curves.curve import Curve


@dataclass(frozen=True)
class Arc(Curve):
    """A part of a circle of `radius` metres, by `angle` radians: left if positive, right if not.

    >>> round(Arc(2.0, -math.pi / 2).length, 9)
    3.141592654
    """

    radius: float
    angle: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive(self.radius, "radius of an arc"))
        angle = float(numbers(self.angle, "angle of an arc (radians)", ()))
        object.__setattr__(self, "angle", angle)
        if angle == 0.0:
            raise InputError("angle of an arc (radians) must not be 0; a Line goes straight")
        self.check()

    @property
    def length(self) -> float:
        """Metres."""
        return self.radius * abs(self.angle)

    @cached_property
    def pieces(self) -> Array:
        """One."""
        return frozen(np.array([[0, 0, 0, 0, math.copysign(1 / self.radius, self.angle), 0, 0.0]]))
