"""The time laws of motions from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import family

TRAJECTORIES = family("trajectory")


class Shares(NamedTuple):
    """The share s of a motion that is done, and its time derivatives."""

    s: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class Timing:
    """The timing of axes that start and stop together, which broadcasts against times.

    `ramp` (..., n) is the share of the time in which an axis speeds up, and in which it slows down
    again; None is for a polynomial of order five, the same for every axis.
    """

    seconds: Array  # (...,)
    ramp: Array | None = None

    @classmethod
    def shortest(cls, way: Array, speed: Any, acceleration: Any) -> Timing:
        """Return the shortest timing of distances (..., n) >= 0, set by the slowest axis."""
        seconds, ramp = fastest(way, speed, acceleration)
        return cls(np.asarray(seconds.max(axis=-1)), ramp)

    def at(self, t: Any) -> Shares:
        """Return shares (..., n), or (..., 1) where all axes are alike, at times t (...)."""
        T = np.where(self.seconds > 0, self.seconds, 1.0)  # axes that need no time do not move
        u = np.asarray(np.clip(np.asarray(t, dtype=float) / T, 0.0, 1.0))
        u = np.where(t >= self.seconds, 1.0, u)[..., None]
        found = quintic(u) if self.ramp is None else trapezoid(u, self.ramp)
        per = 1.0 / T[..., None]
        inside = ((t > 0.0) & (t < self.seconds))[..., None]
        rate, acceleration = found.rate * per, found.acceleration * per * per
        return Shares(found.s, *(np.where(inside, x, 0.0) for x in (rate, acceleration)))


def quintic(u: Array) -> Shares:
    """Return s = 10 u^3 - 15 u^4 + 6 u^5, with zero speed and acceleration at u = 0 and u = 1.

    The polynomial of least integral of the squared jerk (Craig 2005, section 7.3; Siciliano et
    al. 2009, section 4.2.1).
    """
    v = 1.0 - u
    s = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return Shares(s, 30.0 * u * u * v * v, 60.0 * u * v * (1.0 - 2.0 * u))


def trapezoid(u: Array, ramp: Array) -> Shares:
    """Return shares of a trapezoidal speed profile with acceleration for the share `ramp`.

    It is symmetric, s(u) = 1 - s(1 - u), with the speed 1/(1 - ramp) in between (Siciliano et al.
    2009, eqs 4.5 to 4.8).
    """
    peak = 1.0 / (1.0 - ramp)
    early = np.minimum(u, 1.0 - u)
    climbing = early < ramp
    half = peak * np.where(climbing, 0.5 * early * early / ramp, early - 0.5 * ramp)
    s = np.where(u < 0.5, half, 1.0 - half)
    rate = peak * np.where(climbing, early / ramp, 1.0)
    return Shares(s, rate, np.where(climbing, np.where(u < 0.5, peak, -peak) / ramp, 0.0))


def fastest(way: Array, speed: Any, acceleration: Any) -> tuple[Array, Array]:
    """Return seconds of each axis within its limits, and the share of them for acceleration.

    T = d/v + v/a where the limit of the speed is reached, d >= v^2/a, and 2 sqrt(d/a) where not:
    the trapezoid is a triangle then (Siciliano et al. 2009, section 4.2.1).
    """
    with np.errstate(invalid="ignore"):  # for infinite limits
        long = way * acceleration > np.multiply(speed, speed)
        climb = np.where(long, np.divide(speed, acceleration), np.sqrt(way / acceleration))
        seconds = np.where(long, way / speed + climb, 2.0 * climb)
        ramp = np.where(long, climb / np.where(long, seconds, 1.0), 0.5)
    return seconds, ramp


def checked_times(t: Any) -> Array:
    """Return times of any shape in seconds, also infinite; raise InputError for others."""
    try:
        times = np.asarray(t, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"time (seconds): expected numbers, got {t!r:.80}") from None
    if np.isnan(times).any():
        raise InputError("time (seconds): every time must be a number, got nan")
    return times
