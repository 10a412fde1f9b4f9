"""What else may be wrong with an image: effects of a kind that the user brings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, first_view, last_view, numbers, shown_view
from robsim.base.errors import InputError
from robsim.declare import Choice, family
from robsim.kernels.formulas import random

IMAGE_EFFECTS = family("image effect")
FIRST_STREAM = 16  # of random numbers; those below are RobSim's own


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


@runtime_checkable
class ImageEffect(Protocol):
    """What anything must have to be an effect on images: a user's class needs no base class.

    Registered with `register("image effect", "my_effect")`, it has a place in scenario files.
    """

    def seen(self, pixels: Array, exposure: Exposure) -> Array:
        """Return where the marks are seen (B, N, 2), from where they would be, in pixels."""


EFFECT = Choice(IMAGE_EFFECTS, protocol=ImageEffect)


def changed(effect: ImageEffect, pixels: Array, exposure: Exposure) -> Array:
    """Return pixels (N, 2, B) after an effect; InputError for a result of another shape."""
    before = shown_view(pixels)
    found = like(before, effect.seen(before, exposure), f"{type(effect).__name__}.seen", gaps=True)
    return np.ascontiguousarray(last_view(found))


def like(before: Array, given: Any, who: str, *, gaps: bool = False) -> Array:
    """Return what a user's effect made of an array; InputError unless it is of the same shape."""
    found = numbers(given, who, before.shape[1:], gaps=gaps)
    if found.shape != before.shape:
        raise InputError(f"{who}: expected shape {before.shape}, got {found.shape}")
    return found
