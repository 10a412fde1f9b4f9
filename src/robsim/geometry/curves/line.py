"""A straight line."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robsim.base.arrays import Array, frozen, positive
from robsim.geometry.curves.curve import Curve


@dataclass(frozen=True)
class Line(Curve):
    """Straight along x; `length` in metres.

    >>> Line(3.0).at(2.0).position
    array([2., 0., 0.])
    """

    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", positive(self.length, "length of a line"))

    @cached_property
    def pieces(self) -> Array:
        """One."""
        return frozen(np.zeros((1, 7)))
