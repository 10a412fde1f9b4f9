"""The largest factor of the gains at which a linear loop is stable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from robsim.analysis.advising.sampled import Sampled
from robsim.analysis.advising.scaled import Scaled, mode
from robsim.analysis.advising.timing import Timing

FIRST, LAST = 0.01, 1e9  # rate times delay at the first factor, and the largest factor over it
UP = 1.1  # from one factor that is tried to the next
LOWEST = 1e-8  # of the first factor: where even that is unstable, none is stable
HALVINGS = 30
ROUNDS = 400  # of a power iteration


def largest(scaled: Scaled, timing: Timing) -> float:
    """Return the largest factor of the gains below which the loop settles; 0 if there is none.

    It is where an eigenvalue of the map from one image to the next leaves the unit circle. Where
    images are lost, the mean square is to settle.
    """
    if scaled.plain:
        return of_modes(scaled.modes, timing)
    short = timing.short
    first = _first(list(scaled.rates), short)
    return _limit(lambda factor: settles(scaled.at(factor, short)), first)


def of_modes(rates: Sequence[complex], timing: Timing) -> float:
    """Return the same of a loop with these rates per second, which are told apart by the image."""
    short = timing.short.held
    if min(rate.real for rate in rates) <= 0.0:
        return 0.0
    first = _first(rates, short)
    return min(_limit(_Mode(rate, short), first) for rate in rates)


class _Mode(NamedTuple):
    """A mode of a loop, which settles at some factors of its rate."""

    rate: complex
    timing: Timing

    def __call__(self, factor: float) -> bool:
        return settles(mode(factor * self.rate, self.timing))


def settles(loop: Sampled) -> bool:
    """Return whether every motion decays."""
    (A, _), _ = loop.steps()
    if not loop.timing.lost:
        return bool(np.abs(np.linalg.eigvals(A)).max() < 1.0)
    (kept, _), _ = loop.steps(lost=True)
    p, X = loop.timing.lost, np.eye(loop.size, dtype=A.dtype)
    growth = 0.0
    for i in range(ROUNDS):
        X = (1.0 - p) * (A @ X @ A.conj().T) + p * (kept @ X @ kept.conj().T)
        size = float(np.trace(X).real)
        growth += np.log(size) if i >= ROUNDS // 2 else 0.0
        X /= size
    return growth < 0.0


def _first(rates: Sequence[complex], timing: Timing) -> float:
    """Return a factor that is small for these rates."""
    delay = timing.period + timing.latency + timing.lag
    return FIRST / (max(abs(rate) for rate in rates) * delay)


def _limit(stable: Callable[[float], bool], first: float) -> float:
    """Return the least factor that is not stable, from one that is small."""
    low = first
    while not stable(low):
        low /= 10.0
        if low < LOWEST * first:
            return 0.0
    high = UP * low
    while stable(high):
        low, high = high, UP * high
        if high > LAST * first:
            return float("inf")
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low
