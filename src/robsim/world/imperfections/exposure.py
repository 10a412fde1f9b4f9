"""The exposure of an image, which effects in Python are shown, and its random numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, first_view, numbers
from robsim.base.errors import InputError
from robsim.kernels.formulas import random


class Draws:
    """Random numbers, keyed by the seed and the number of each run, and counted by the step.

    So a run has the same ones alone and in any batch.
    """

    step: int
    seed: np.uint64
    runs: NDArray[np.uint64]  # (B,)
    stream: int

    def normal_pairs(self, count: int) -> Array:
        """Return independent standard normal numbers (count, 2, B)."""
        out = np.empty((count, 2, self.runs.size))
        random.normal_pairs(self.seed, self.runs, self.step, self.stream, out)
        return out


@dataclass(frozen=True, eq=False)
class Exposure(Draws):
    """When an image was taken, by which camera of which target, for B runs."""

    time: float  # seconds since the start
    camera: str
    target: str
    step: int
    seed: np.uint64
    runs: NDArray[np.uint64]  # (B,)
    stream: int

    def normal(self, marks: int) -> Array:
        """Return independent standard normal numbers (B, marks, 2)."""
        return first_view(self.normal_pairs(marks))

    def uniform(self, marks: int) -> Array:
        """Return independent uniform numbers (B, marks), between 0 and 1."""
        out = np.empty((marks, self.runs.size))
        random.uniforms(self.seed, self.runs, self.step, self.stream + 1, out)
        return first_view(out)


def like(before: Array, given: Any, who: str, *, gaps: bool = False) -> Array:
    """Return what a user's effect made of an array; InputError unless it is of the same shape."""
    found = numbers(given, who, before.shape[1:], gaps=gaps)
    if found.shape != before.shape:
        raise InputError(f"{who}: expected shape {before.shape}, got {found.shape}")
    return found
