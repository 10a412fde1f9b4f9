"""Quantiles of Fisher's F distribution, which determine the size of confidence ellipsoids."""

from __future__ import annotations

import math

from robsim.statistics.chi_square_distribution import chi_square_quantile
from robsim.statistics.proportions import check_level

MOST_FREEDOM = 1e6  # larger finite denominators count as this
TERMS = 10_000  # most terms of the continued fraction


def fisher_quantile(level: float, numerator: float, denominator: float) -> float:
    """Return the quantile of F; an infinite denominator means a known variance, chi square.

    It is found by bisection of the distribution I_x(n/2, m/2), x = n F / (n F + m), the regularised
    incomplete beta function (NIST Digital Library of Mathematical Functions 8.17). Raises
    InputError unless the level is between 0 and 1.

    >>> round(fisher_quantile(0.95, 6, 100), 3), round(6 * fisher_quantile(0.95, 6, math.inf), 3)
    (2.191, 12.592)
    """
    check_level(level)
    if math.isinf(denominator):
        return chi_square_quantile(level, numerator) / numerator
    m = min(float(denominator), MOST_FREEDOM)
    low, high = 0.0, 1.0
    while high - low > 1e-15 * high:
        x = 0.5 * (low + high)
        low, high = (x, high) if _incomplete_beta(x, numerator / 2, m / 2) < level else (low, x)
        if x in (low, high) and 0.5 * (low + high) in (low, high):
            break
    return m * high / (numerator * (1.0 - high))


def _incomplete_beta(x: float, a: float, b: float) -> float:
    """Return I_x(a, b) by the continued fraction 8.17.22, on the side of fast convergence."""
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _incomplete_beta(1.0 - x, b, a)
    if x <= 0.0:
        return 0.0
    log = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(log + a * math.log(x) + b * math.log1p(-x)) / a
    return front / _beta_fraction(x, a, b)


def _beta_fraction(x: float, a: float, b: float) -> float:
    """Return 1 + d1/(1 + d2/(1 + ...)) by the method of Lentz."""
    value, up, down = 1.0, 1.0, 0.0
    for i in range(1, TERMS):
        n = i // 2
        if i % 2:
            d = -(a + n) * (a + b + n) * x / ((a + 2 * n) * (a + 2 * n + 1))
        else:
            d = n * (b - n) * x / ((a + 2 * n - 1) * (a + 2 * n))
        down, up = 1.0 / (1.0 + d * down), 1.0 + d / up
        value *= up * down
        if abs(up * down - 1.0) < 1e-15:
            break
    return value
