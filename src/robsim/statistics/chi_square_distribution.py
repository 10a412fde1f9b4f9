"""Quantiles of the chi-square distribution, for residuals of a known noise."""

from __future__ import annotations

import math

from robsim.statistics.proportions import check_level

TERMS = 10_000  # most terms of the series and of the continued fraction
TINY = 1e-300


def chi_square_quantile(level: float, freedom: float) -> float:
    """Return the quantile of chi square with some degrees of freedom.

    It is found by bisection of the distribution P(n/2, x/2), the regularised incomplete gamma
    function (NIST Digital Library of Mathematical Functions 8.2.4). Raises InputError unless the
    level is between 0 and 1.

    >>> round(chi_square_quantile(0.95, 6), 3), round(chi_square_quantile(0.5, 2), 6)
    (12.592, 1.386294)
    """
    check_level(level)
    low, high = 0.0, freedom + 1.0
    while _incomplete_gamma(freedom / 2, high / 2) < level:
        low, high = high, 2.0 * high
    while high - low > 1e-15 * high:
        x = 0.5 * (low + high)
        if x in (low, high):
            break
        low, high = (x, high) if _incomplete_gamma(freedom / 2, x / 2) < level else (low, x)
    return high


def _incomplete_gamma(a: float, x: float) -> float:
    """Return P(a, x) by the power series 8.11.4, or the continued fraction 8.9.2 for large x."""
    if x <= 0.0:
        return 0.0
    front = math.exp(a * math.log(x) - x - math.lgamma(a))
    return front * _series(a, x) if x < a + 1.0 else 1.0 - front * _fraction(a, x)


def _series(a: float, x: float) -> float:
    """Return the sum of x^n / (a (a + 1) ... (a + n))."""
    term = total = 1.0 / a
    for n in range(1, TERMS):
        term *= x / (a + n)
        total += term
        if term < 1e-17 * total:
            break
    return total


def _fraction(a: float, x: float) -> float:
    """Return 1/(x + 1 - a - 1 (1 - a)/(x + 3 - a - ...)) by the method of Lentz."""
    b = x + 1.0 - a
    up, down = 1.0 / TINY, 1.0 / b
    value = down
    for n in range(1, TERMS):
        c, b = -n * (n - a), b + 2.0
        down = 1.0 / ((c * down + b) or TINY)
        up = (b + c / up) or TINY
        value *= up * down
        if abs(up * down - 1.0) < 1e-15:
            break
    return value
