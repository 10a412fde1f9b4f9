"""Time laws of motions from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import family
from robsim.kernels.formulas import speed_profiles as kernels

TRAJECTORIES = family("trajectory")
QUINTIC_RAMP = -1.0  # ramp value that selects the polynomial of order five in the kernel


class TimeLawShares(NamedTuple):
    """Completed fraction s of a motion, and its first and second time derivatives."""

    s: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class Timing:
    """Time law of axes that start and stop together.

    Attributes
    ----------
    seconds : ndarray of shape (...)
        Duration of the motion.
    ramp : ndarray of shape (..., n), optional
        Fraction of the duration during which each axis speeds up, and again slows down. Default: a
        polynomial of order five, the same for every axis.
    """

    seconds: Array
    ramp: Array | None = None

    @classmethod
    def shortest(cls, distance: Array, speed: Array, acceleration: Array) -> Timing:
        """Return the shortest timing of distances (..., n) >= 0, set by the slowest axis."""
        numbers = distance, speed, acceleration
        flat = [np.broadcast_to(x, distance.shape).ravel() for x in numbers]
        seconds, ramp = np.empty((2, *distance.shape))
        kernels.compute_shortest_times(*flat, seconds.reshape(-1), ramp.reshape(-1))
        return cls(np.asarray(seconds.max(axis=-1)), ramp)

    def at(self, t: ArrayLike) -> TimeLawShares:
        """Return fractions (..., n) at times t (...), or (..., 1) if all axes have one time law."""
        ramp = np.array([QUINTIC_RAMP]) if self.ramp is None else self.ramp
        times, seconds = np.asarray(t, dtype=float)[..., None], self.seconds[..., None]
        shape = np.broadcast_shapes(times.shape, seconds.shape, ramp.shape)
        flat = [np.broadcast_to(x, shape).ravel() for x in (times, seconds, ramp)]
        shares = np.empty((flat[0].size, 3))
        kernels.compute_motion_shares(*flat, shares)
        return TimeLawShares(*(np.array(each).reshape(shape) for each in shares.T))


def check_times(t: ArrayLike) -> Array:
    """Return times (...) in seconds, which may be infinite; raise InputError for other values."""
    try:
        times = np.asarray(t, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"time (seconds): expected numbers, got {format_value(t)}") from None
    if np.isnan(times).any():
        raise InputError("time (seconds): every time must be a number, got nan")
    return times
