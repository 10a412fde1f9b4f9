"""The state of the drives, which effects on joints in Python are shown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.world.imperfections.exposure import Draws


@dataclass(frozen=True, eq=False)
class Drive(Draws):
    """The state of the drives at a control instant, for B runs, with the run first.

    time     seconds since the start
    q        coordinates (B, nq) of the scene
    moved    velocities (B, n) of the commanded joints in the period that ends, zero at the start
    """

    time: float
    q: Array
    moved: Array
    step: int
    seed: np.uint64
    runs: NDArray[np.uint64]  # (B,)
    stream: int

    def normal(self, count: int) -> Array:
        """Return independent standard normal numbers (B, count)."""
        rows = self.normal_pairs(-(-count // 2)).reshape(-1, self.runs.size)
        return np.ascontiguousarray(rows[:count].T)
