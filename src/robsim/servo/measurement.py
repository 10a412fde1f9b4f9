"""What a controller measures at one instant, and what it remembers until the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, first_view, last_view


@dataclass(frozen=True, eq=False)
class Measurement:
    """What encoders give a controller in Python at one instant of some runs, and its memory."""

    step: int
    dt: float
    q: Array  # (nq, B) as measured
    memory: dict[str, Any]  # arrays with the run first, until the next instant

    @property
    def time(self) -> float:
        """The time in seconds since the start."""
        return self.step * self.dt

    @property
    def runs(self) -> int:
        """The number of runs B."""
        return int(self.q.shape[1])


def remember(memory: dict[str, Any], name: str, array: Array) -> None:
    """Keep an array, whose last axis is the run, in a memory."""
    memory[name] = first_view(array)


def recall(memory: dict[str, Any], name: str) -> Array:
    """Return an array that was kept in a memory, with the run last."""
    return np.ascontiguousarray(last_view(memory[name]))
