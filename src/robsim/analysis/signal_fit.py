"""Least-squares fit of one signal by another: factor, delay and lag."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array

SMALL_RESIDUAL = 0.05  # largest residual of signals that agree
LONGEST_DELAY = 25  # longest delay, in periods
LONGEST_LAG, LAG_STEP = 25.0, 0.25  # longest lag and step of its fine grid, in periods


@dataclass(frozen=True)
class SignalFit:
    """Fit response(t) = scale * input(t - periods dt) of two signals, after a lag.

    `periods` is the delay and `lag` the time constant, both in periods dt. `rest` is the norm of
    the residual as a share of the norm of the response, and `largest` the largest difference of the
    two signals before the fit.
    """

    scale: float
    periods: int
    lag: float
    rest: float
    largest: float

    @property
    def is_same(self) -> bool:
        """Whether the signals agree without delay, to within a small residual."""
        late = self.periods > 0 or self.lag > 0.0
        return not late and self.rest <= SMALL_RESIDUAL and abs(self.scale - 1.0) <= self.rest


def fit_signals(signal: Array, response: Array, lags: bool = False) -> SignalFit:
    """Fit a response signal (T, n) by an input signal, by least squares over factor, delay and lag.

    Delays are whole periods, at most 25 and half of T. With `lags` a first-order lag of at most 25
    periods is fitted too, to a quarter of a period. If the residual without delay and lag is small,
    both are zero unless they halve the residual. Among fits of equal residual the smallest lag and
    delay are returned. The factor is NaN if one of the signals is zero.

    >>> signal = np.sin(np.arange(100.0))[:, None]
    >>> fit = fit_signals(signal, 0.5 * np.roll(signal, 3, axis=0))
    >>> round(fit.scale, 9), fit.periods
    (0.5, 3)
    """
    largest = float(np.abs(response - signal).max(initial=0.0))
    best = _best_fit(signal, response, np.arange(LONGEST_LAG + 1.0) if lags else np.zeros(1))
    if lags:
        fine_lags = best[2] + np.arange(-1.0, 1.0 + LAG_STEP, LAG_STEP)
        best = _best_fit(signal, response, fine_lags[fine_lags >= 0.0])
    scale, delay, lag, rest = best
    scale_without_lag, rest_without_lag = _fit_factor(signal, response)
    if lags and rest_without_lag <= SMALL_RESIDUAL and rest_without_lag <= 2.0 * rest:
        scale, delay, lag, rest = scale_without_lag, 0, 0.0, rest_without_lag
    return SignalFit(scale, delay, lag, min(rest, 1.0), largest)


def average_window(rates: Array, periods: int) -> Array:
    """Return the moving average of a signal (T, n) over a number of periods, zero before the first.

    Clock jitter, which records a value one period early or late, changes the average little.
    Factors, delays and first-order lags from rest are preserved.

    >>> average_window(np.array([[4.0], [0.0], [2.0], [2.0]]), 2)[:, 0]
    array([2., 2., 1., 2.])
    """
    sums = np.concatenate([np.zeros((periods, rates.shape[1])), np.cumsum(rates, axis=0)])
    means: Array = (sums[periods:] - sums[:-periods]) / periods
    return means


def _best_fit(signal: Array, response: Array, lags: Array) -> tuple[float, int, float, float]:
    """Return factor, delay, lag and residual of the best fit over some lags and all delays."""
    best = math.nan, 0, 0.0, math.inf
    for lag in lags.tolist():
        lagged = _apply_lag(signal, lag)
        for delay in range(min(LONGEST_DELAY, len(signal) // 2) + 1):
            scale, rest = _fit_factor(lagged[: len(signal) - delay], response[delay:])
            if rest < best[-1]:
                best = scale, delay, lag, rest
    return best


def _apply_lag(signal: Array, lag: float) -> Array:
    """Return the output of a first-order lag, averaged over each period of a held input signal.

    With v' = (u - v) / lag over one period and constant u, v goes from v0 to u - (u - v0) exp(-1 /
    lag), and its mean is u - (u - v0) lag (1 - exp(-1 / lag)).
    """
    if not lag:
        return signal
    remaining = math.exp(-1.0 / lag)
    means, value = np.empty_like(signal), np.zeros(signal.shape[1])
    for i, row in enumerate(signal):
        gap = row - value
        means[i] = row - gap * lag * (1.0 - remaining)
        value = row - gap * remaining
    return means


def _fit_factor(signal: Array, response: Array) -> tuple[float, float]:
    """Return the least-squares factor, and the norm of the residual as a share of the response."""
    input_norm, response_norm = float((signal**2).sum()), float((response**2).sum())
    if not input_norm or not response_norm:
        return math.nan, math.inf
    scale = float((signal * response).sum()) / input_norm
    residual = response - scale * signal
    return scale, math.sqrt(float((residual**2).sum()) / response_norm)
