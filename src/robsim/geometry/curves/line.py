"""Straight line."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.declare import check_fields, register
from robsim.geometry.curves.curve import Curve, CurveLength


@register("curve", "line")
@dataclass(frozen=True)
class Line(Curve):
    """Straight line from the origin along x.

    It is the curve of a straight rail. Its curvature is zero, and its pose at arc length s is the
    translation by (s, 0, 0):

    >>> Line(3.0).at(2.0).position
    array([2., 0., 0.])
    """

    length: CurveLength

    def __post_init__(self) -> None:
        check_fields(self)

    @cached_property
    def pieces(self) -> Array:
        """Single piece (1, 7) of the line, in the format of `Curve.pieces`."""
        return make_read_only(np.zeros((1, 7)))
