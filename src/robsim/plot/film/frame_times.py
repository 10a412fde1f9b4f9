"""Choice of the instant of a run for each frame of a film."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_positive
from robsim.base.errors import InputError

LONGEST = 60.0  # seconds of a film at the default speed
MOST = 6000  # frames
ROUNDING = 1e-9  # tolerance of the number of frames


@dataclass(frozen=True)
class FrameTimes:
    """The instant of a run that each frame of a film shows.

    Attributes
    ----------
    speed : float
        Seconds of the run in one second of the film.
    instants : array of shape (frames,)
        Index of the instant that each frame shows.
    """

    speed: float
    instants: NDArray[np.intp]


def choose_frame_times(time: Array, fps: float, speed: float | None) -> FrameTimes:
    """Return the recorded instant that each frame of a film shows.

    `time` (T,) are the recorded times in seconds. Frame k shows the instant nearest to the time k
    speed / fps, and the last frame shows the last instant. The default speed is 1, or the smallest
    integer that keeps the film within one minute.

    Raise InputError if the speed is not positive, or if the film has more than 6000 frames.

    >>> choose_frame_times(np.arange(5) * 0.1, 5.0, 1.0).instants
    array([0, 2, 4])
    """
    duration = float(time[-1] - time[0])
    fast = max(1.0, np.ceil(duration / LONGEST)) if speed is None else as_positive(speed, "speed")
    count = duration * fps / fast - ROUNDING
    if not count < MOST:
        raise InputError(
            f"{duration:.4g} s at {fps:g} frames per second and speed {fast:g} are {count:.3g} "
            f"frames, and a film has at most {MOST}: reduce fps, or increase speed"
        )
    at = np.minimum(time[0] + np.arange(int(np.ceil(count)) + 1) * fast / fps, time[-1])
    midpoints = (time[1:] + time[:-1]) / 2
    return FrameTimes(float(fast), np.searchsorted(midpoints, at, "right"))
