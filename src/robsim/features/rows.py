"""The rows of a program with what a controller knows of the marks, and of a feature of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.kernels import commanding
from robsim.kernels.program import Program


class FeatureRows(NamedTuple):
    """The rows of a feature s (k,) and of its interaction matrix L (k, 6)."""

    k: int
    s: int
    L: int


@dataclass(frozen=True)
class Seen:
    """The rows of an observation of N marks, as `Observation` has them."""

    program: Program
    N: int
    pixels: int  # 2 for each mark
    points: int  # 2 for each mark, normalised
    depth: int
    camera: int  # in the order of `robsim.kernels.viewing`
    model: int  # 3 for each mark
    guess: int  # 12, the pose from which an estimate of T_c_o starts
    other: Seen | None = None  # the same marks, as the second camera of a pair sees them
    between: int = -1  # 12, the pose of the second camera in this one

    def room(self, k: int) -> FeatureRows:
        """Return new rows for a feature of k numbers."""
        return FeatureRows(k, self.program.rows(k), self.program.rows(6 * k))

    def some(self, marks: NDArray[np.int64]) -> Seen:
        """Return the rows of some of the marks, with the stage that copies them."""
        other = None if self.other is None else self.other.some(marks)
        sizes = {"pixels": 2, "points": 2, "depth": 1, "model": 3}
        found = {name: self._copied(getattr(self, name), marks, n) for name, n in sizes.items()}
        return replace(self, N=len(marks), other=other, **found)

    def _copied(self, first: int, marks: NDArray[np.int64], size: int) -> int:
        rows = self.program.rows(size * len(marks))
        for i, mark in enumerate(marks):
            self.program.add(commanding.copied, size, first + size * mark, rows + size * i)
        return rows
