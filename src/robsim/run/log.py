"""Logs: recordings of a robot and its cameras, each signal with its own times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.run.log_activity import LogActivity
from robsim.servo.camera_target import PairKey

NANO = 1_000_000_000  # nanoseconds per second
Times = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stream:
    """Values (n, ...) of a signal at times (n,) in nanoseconds.

    `what` names the origin of the signal in messages. `captured` has the capture times of images
    that arrived at `times`. Raise FileError if there are no values, or if the clock runs backwards.
    """

    what: str
    times: Times
    values: Array
    captured: Times | None = None

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

    def ages(self, index: NDArray[np.int64], times: Times) -> Array:
        """Return the ages (T,) in seconds of the values with some indices at times (T,)."""
        captured = self.times if self.captured is None else self.captured
        ages: Array = (times - captured[index]) / NANO
        return ages

    def held(self, times: Times) -> Array:
        """Return the last value at each time; zero before the first value."""
        last = self.index(times)
        values: Array = self.values[np.maximum(last, 0)].copy()
        values[last < 0] = 0.0
        return values


@dataclass(frozen=True, eq=False)
class Log:
    """Recording of a robot: joint coordinates and images, and optionally commands and rates."""

    source: str
    joints: Stream  # (n, nq) coordinates of the scene
    images: Mapping[PairKey, Stream]  # (n, N, 2) pixels of the marks, NaN if a mark is not seen
    commands: Stream | None = None  # (n, nv)
    rates: Stream | None = None  # (n, nv) measured velocities
    activity: LogActivity | None = None
    notes: Mapping[str, Any] = field(default_factory=dict)  # attributes of the run

    @property
    def first(self) -> int:
        """The first time in nanoseconds when joints are known and every mark has been seen."""
        return max(
            [
                int(self.joints.times[0]),
                *(_find_first_complete_time(each) for each in self.images.values()),
            ]
        )


def hold_marks(images: Stream, times: Times) -> Array:
    """Return the pixels (T, N, 2) of the last image before each time (zero-order hold).

    At the first time each mark has its last observed pixels, also from an earlier image. Every mark
    must have been observed once before the first time.
    """
    pixels = images.held(times)
    until = images.values[: int(images.index(times[:1])[0]) + 1]
    seen = np.asarray(~np.isnan(until).any(axis=-1))
    last = len(until) - 1 - np.argmax(seen[::-1], axis=0)
    pixels[0] = until[last, np.arange(until.shape[1])]
    return pixels


def _find_first_complete_time(images: Stream) -> int:
    """Return the first time when every mark has been seen; FileError if a mark never was."""
    seen = ~np.isnan(images.values).any(axis=-1)
    never = np.flatnonzero(~seen.any(axis=0))
    if never.size:
        raise FileError(f"{images.what}: mark {never[0]} was never seen")
    return int(images.times[np.argmax(seen, axis=0).max(initial=0)])
