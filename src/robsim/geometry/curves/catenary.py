"""Curve of a cable that hangs between two points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.declare import Vector, check_fields, register
from robsim.geometry.curves.curve import Curve, CurveLength


@register("curve", "catenary")
@dataclass(frozen=True)
class Catenary(Curve):
    """Curve of a cable that hangs between two points in the plane, with y up.

    With the lowest point at x = 0, the curve is y = a cosh(x / a) + constant. The parameter a
    solves

        sqrt(length^2 - v^2) = 2 a sinh(h / (2 a))

    for end points with the horizontal distance h and the height difference v (e.g. H. M. Irvine,
    Cable Structures, 1981). A longer cable sags more.

    Raises
    ------
    InputError
        If the x of the end does not exceed the x of the start, or the cable is not longer than the
        distance between both.

    Examples
    --------
    >>> cable = Catenary((0, 0), (10, 0), 10.2)
    >>> cable.at(5.1).position.round(3)  # the middle is the lowest point
    array([ 5.   , -0.872,  0.   ])
    """

    start: Annotated[
        tuple[float, float], Vector("length", 2), "First point (x, y) of the curve, with y up."
    ]
    end: Annotated[
        tuple[float, float], Vector("length", 2), "Last point (x, y) of the curve, with y up."
    ]
    length: CurveLength

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, start: ArrayLike, end: ArrayLike, length: float) -> None: ...

    def __post_init__(self) -> None:
        check_fields(self)
        length = self.length
        apart = math.dist(self.start, self.end)
        if self.end[0] <= self.start[0]:
            raise InputError(
                f"a catenary goes to larger x, from {self.start[0]:g} not to {self.end[0]:g}"
            )
        if length <= apart * (1 + 1e-9):
            raise InputError(
                f"a catenary of {length:g} m does not hang between points {apart:g} m apart; "
                "make it longer, or take a Line"
            )
        self.check()

    @cached_property
    def parameter(self) -> float:
        """Parameter a in metres, the radius of curvature at the lowest point."""
        h: float = self.end[0] - self.start[0]
        v: float = self.end[1] - self.start[1]
        apart = math.hypot(h, v)
        ratio = math.sqrt((self.length - v) * (self.length + v)) / h  # sinh(z)/z with z = h/(2a)
        excess = (self.length - apart) * (self.length + apart) / (h * h) / (ratio + 1.0)
        z = math.sqrt(6.0 * excess) if ratio < 3.0 else math.log(2.0 * ratio) + 1.0
        for _ in range(100):  # Newton on a convex function, from the right
            value, slope = _sinhc_excess(z)
            step = (value - excess) / slope
            z -= step
            if abs(step) <= 1e-16 * z:
                break
        return h / (2.0 * z)

    @cached_property
    def pieces(self) -> Array:
        """Single piece (1, 7) of the catenary, in the format of `Curve.pieces`."""
        h, v, a = self.end[0] - self.start[0], self.end[1] - self.start[1], self.parameter
        middle = a * math.atanh(v / self.length)  # x of the middle, from the lowest point
        u = a * math.sinh((middle - 0.5 * h) / a)
        return make_read_only(np.array([[0.0, *self.start, math.atan2(u, a), 0.0, a, u]]))


def _sinhc_excess(z: float) -> tuple[float, float]:
    """Return sinh(z)/z - 1 and its derivative, for z > 0, without cancellation."""
    if z > 1.0:
        return math.sinh(z) / z - 1.0, (math.cosh(z) - math.sinh(z) / z) / z
    value = slope = 0.0
    for n in range(12, 0, -1):  # the terms z^(2n) / (2n + 1)!, nested
        factor = 1.0 / ((2 * n) * (2 * n + 1))
        slope = factor * (2.0 * z * (1.0 + value) + z * z * slope)
        value = factor * z * z * (1.0 + value)
    return value, slope
