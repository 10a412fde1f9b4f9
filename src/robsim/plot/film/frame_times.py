"""Which instant of a run each frame of a film shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_positive
from robsim.base.errors import InputError

LONGEST = 60.0  # seconds of a film whose speed is not said
MOST = 6000  # frames
ROUNDING = 1e-9  # of a frame, by which a run may end late


@dataclass(frozen=True)
class FrameTimes:
    """Seconds of the run in one of the film, and an instant for each frame."""

    speed: float
    instants: NDArray[np.intp]


def choose_frame_times(time: Array, fps: float, speed: float | None) -> FrameTimes:
    """Return the instants that the frames of a film show, of those at times (T,) in seconds.

    Frame k shows the instant nearest to k speed / fps, and the last frame the last instant. Without
    a speed it is real time, or as many times faster as a film of one minute needs.

    InputError: a speed that is not above zero, or more frames than 6000.

    >>> choose_frame_times(np.arange(5) * 0.1, 5.0, 1.0).instants
    array([0, 2, 4])
    """
    spell = float(time[-1] - time[0])
    fast = max(1.0, np.ceil(spell / LONGEST)) if speed is None else as_positive(speed, "speed")
    count = spell * fps / fast - ROUNDING
    if not count < MOST:
        raise InputError(
            f"{spell:.4g} s at {fps:g} frames per second and speed {fast:g} are {count:.3g} "
            f"frames, and a film has at most {MOST}: give fewer fps, or a higher speed"
        )
    at = np.minimum(time[0] + np.arange(int(np.ceil(count)) + 1) * fast / fps, time[-1])
    between = (time[1:] + time[:-1]) / 2
    return FrameTimes(float(fast), np.searchsorted(between, at, "right"))
