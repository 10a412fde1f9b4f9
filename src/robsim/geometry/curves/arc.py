"""Arc of a circle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.declare import Angle, check_fields, register
from robsim.geometry.curves.curve import Curve, CurveRadius


@register("curve", "arc")
@dataclass(frozen=True)
class Arc(Curve):
    """Arc of a circle that begins at the origin, along x.

    The curvature is sign(angle) / radius, and the length is radius |angle|.

    >>> round(Arc(2.0, -math.pi / 2).length, 9)
    3.141592654
    """

    radius: CurveRadius
    angle: Annotated[float, Angle(), "Angle of the arc, positive to the left. Not 0."]

    def __post_init__(self) -> None:
        check_fields(self)
        if self.angle == 0.0:
            raise InputError("angle of an arc (radians) must not be 0; a Line goes straight")
        self.check()

    @property
    def length(self) -> float:
        """Length of the arc, in metres."""
        return self.radius * abs(self.angle)

    @cached_property
    def pieces(self) -> Array:
        """Single piece (1, 7) of the arc, in the format of `Curve.pieces`."""
        return make_read_only(
            np.array([[0, 0, 0, 0, math.copysign(1 / self.radius, self.angle), 0, 0.0]])
        )
