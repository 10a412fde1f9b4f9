"""How well some signals follow others: by which factor, and how late."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array

SMALL_RESIDUAL = 0.05  # share that may be left of what is said to follow
LONGEST_DELAY = 25  # periods of a delay
LONGEST_LAG, LAG_STEP = (
    25.0,
    0.25,
)  # periods of a lag, and of the fine grid around the best whole one


@dataclass(frozen=True)
class SignalFit:
    """What of found(t) is scale given(t - periods dt), after a lag of so many periods.

    The share `rest` of its length is left; `largest` is the largest distance as they are.
    """

    scale: float
    periods: int
    lag: float
    rest: float
    largest: float

    @property
    def is_same(self) -> bool:
        """Whether one is the other, at once and by a factor of 1 to within a small rest."""
        late = self.periods > 0 or self.lag > 0.0
        return not late and self.rest <= SMALL_RESIDUAL and abs(self.scale - 1.0) <= self.rest


def fit_signals(given: Array, found: Array, lags: bool = False) -> SignalFit:
    """Return how one signal (T, n) follows another, by least squares at the best delay.

    Delays are whole periods, up to 25 and half of T; with `lags` also those of first order, up to
    25 periods, to a quarter of one, and neither where the rest is small without and they do not
    halve it. Of equal rests it is the least lag and delay. NaN where one of them is zero
    throughout.

    >>> given = np.sin(np.arange(100.0))[:, None]
    >>> late = fit_signals(given, 0.5 * np.roll(given, 3, axis=0))
    >>> round(late.scale, 9), late.periods
    (0.5, 3)
    """
    largest = float(np.abs(found - given).max(initial=0.0))
    best = _best_fit(given, found, np.arange(LONGEST_LAG + 1.0) if lags else np.zeros(1))
    if lags:
        near = best[2] + np.arange(-1.0, 1.0 + LAG_STEP, LAG_STEP)
        best = _best_fit(given, found, near[near >= 0.0])
    scale, late, lag, rest = best
    plain, left = _fit_factor(given, found)
    if lags and left <= SMALL_RESIDUAL and left <= 2.0 * rest:
        scale, late, lag, rest = plain, 0, 0.0, left
    return SignalFit(scale, late, lag, min(rest, 1.0), largest)


def average_window(rates: Array, periods: int) -> Array:
    """Return the means of a signal (T, n) over the last so many periods, zero before the first.

    A value that is recorded a period early or late, by a clock that trembles, changes such a mean
    by little; factors, delays and lags of first order from rest stay as they are.

    >>> average_window(np.array([[4.0], [0.0], [2.0], [2.0]]), 2)[:, 0]
    array([2., 2., 1., 2.])
    """
    ways = np.concatenate([np.zeros((periods, rates.shape[1])), np.cumsum(rates, axis=0)])
    found: Array = (ways[periods:] - ways[:-periods]) / periods
    return found


def _best_fit(given: Array, found: Array, lags: Array) -> tuple[float, int, float, float]:
    """Return factor, delay, lag and rest of the least rest among some lags and all delays."""
    best = math.nan, 0, 0.0, math.inf
    for lag in lags.tolist():
        behind = _apply_lag(given, lag)
        for late in range(min(LONGEST_DELAY, len(given) // 2) + 1):
            scale, rest = _fit_factor(behind[: len(given) - late], found[late:])
            if rest < best[-1]:
                best = scale, late, lag, rest
    return best


def _apply_lag(given: Array, lag: float) -> Array:
    """Return the means over each period of what lags behind a held signal, from rest.

    With v' = (u - v) / lag over one period, u held: v goes from v0 to u - (u - v0) exp(-1 / lag),
    and its mean is u - (u - v0) lag (1 - exp(-1 / lag)).
    """
    if not lag:
        return given
    left = math.exp(-1.0 / lag)
    found, now = np.empty_like(given), np.zeros(given.shape[1])
    for i, row in enumerate(given):
        gap = row - now
        found[i] = row - gap * lag * (1.0 - left)
        now = row - gap * left
    return found


def _fit_factor(given: Array, found: Array) -> tuple[float, float]:
    """Return the factor, and the share of the length of `found` that it leaves."""
    own, other = float((given**2).sum()), float((found**2).sum())
    if not own or not other:
        return math.nan, math.inf
    scale = float((given * found).sum()) / own
    left = found - scale * given
    return scale, math.sqrt(float((left**2).sum()) / other)
