"""A straight line."""

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
    """A straight line along x, `length` metres long.

    >>> Line(3.0).at(2.0).position
    array([2., 0., 0.])
    """

    length: CurveLength

    def __post_init__(self) -> None:
        check_fields(self)

    @cached_property
    def pieces(self) -> Array:
        """The single piece (1, 7) of the line, see `robsim.kernels.formulas.plane_curves.CurveTable`."""
        return make_read_only(np.zeros((1, 7)))
