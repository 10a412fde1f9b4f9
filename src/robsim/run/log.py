"""Logs: recordings of a robot and its cameras, each signal with its own times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.servo.camera_target import PairKey

NANO = 1_000_000_000  # nanoseconds per second
Times = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stream:
    """Values (n, ...) of a signal at times (n,) in nanoseconds.

    `what` names the origin of the signal in messages. Raise FileError if there are no values, or if
    the clock runs backwards.
    """

    what: str
    times: Times
    values: Array

    def __post_init__(self) -> None:
        if not len(self.times):
            raise FileError(f"{self.what}: nothing was recorded")
        back = np.flatnonzero(np.diff(self.times) < 0)
        if back.size:
            before, after = self.times[back[0] : back[0] + 2] / NANO
            raise FileError(
                f"{self.what}: the clock goes backwards, to {after:.9g} s after {before:.9g} s"
            )

    def index(self, times: Times) -> NDArray[np.int64]:
        """Return the index of the last value at each time; -1 before the first value."""
        return np.asarray(np.searchsorted(self.times, times, side="right") - 1)

    def nearest(self, times: Times) -> NDArray[np.int64]:
        """Return the index of the value nearest to each time, the earlier of two at equal distance.

        Of values at the same time it is the last.
        """
        before = np.maximum(self.index(times), 0)
        after = self.index(self.times[np.minimum(before + 1, len(self.times) - 1)])
        is_after = np.abs(self.times[after] - times) < np.abs(self.times[before] - times)
        return np.asarray(np.where(is_after, after, before))

    def find_step(self, longest: float) -> float:
        """Return the median nanoseconds between two values, at most `longest`."""
        steps = np.diff(self.times)
        return min(float(np.median(steps[steps > 0])) if steps.any() else longest, longest)

    def take(self, index: NDArray[np.int64]) -> Array:
        """Return the values at indices; zero at -1, before the first value."""
        values: Array = self.values[np.maximum(index, 0)].copy()
        values[index < 0] = 0.0
        return values


@dataclass(frozen=True, eq=False)
class Log:
    """Recording of a robot: joint coordinates and images, and optionally commands and rates."""

    source: str
    joints: Stream  # (n, nq) coordinates of the scene
    images: Mapping[PairKey, Stream]  # (n, N, 2) pixels of the marks, NaN if a mark is not seen
    commands: Stream | None = None  # (n, nv)
    rates: Stream | None = None  # (n, nv) measured velocities
    notes: Mapping[str, Any] = field(default_factory=dict)  # attributes of the run

    @property
    def first(self) -> int:
        """The first time in nanoseconds when joints are known and every mark has been seen."""
        complete = [int(each.times[find_first_complete(each)]) for each in self.images.values()]
        return max([int(self.joints.times[0]), *complete])


def hold_marks(images: Stream, index: NDArray[np.int64]) -> Array:
    """Return the pixels (T, N, 2) of the images with some indices.

    At the first index each mark has its last observed pixels, also from an earlier image. Every
    mark must have been observed once until then.
    """
    pixels: Array = images.values[index].copy()
    until = images.values[: index[0] + 1]
    seen = np.asarray(~np.isnan(until).any(axis=-1))
    last = len(until) - 1 - np.argmax(seen[::-1], axis=0)
    pixels[0] = until[last, np.arange(until.shape[1])]
    return pixels


def find_first_complete(images: Stream) -> int:
    """Return the index of the first image until which every mark has been seen.

    Raise FileError if a mark was never seen.
    """
    seen = ~np.isnan(images.values).any(axis=-1)
    never = np.flatnonzero(~seen.any(axis=0))
    if never.size:
        raise FileError(f"{images.what}: mark {never[0]} was never seen")
    return int(np.argmax(seen, axis=0).max(initial=0))
