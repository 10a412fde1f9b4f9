"""Tests and intervals for pairs: difference of two shares, and median of differences."""

from __future__ import annotations

import math

import numpy as np

from robsim.base.arrays import Array
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import check_level, estimate_share


def half_binomial(n: int) -> Array:
    """Return P(X <= k) (n // 2 + 1,) for k = 0 ... n // 2, of X ~ Bin(n, 1/2).

    The probabilities are computed as multiples of the middle probability, without logarithms and
    without loss of digits for large n; values below 1e-308 become 0.

    >>> half_binomial(4)
    array([0.0625, 0.3125, 0.6875])
    """
    low, high = n // 2, n - n // 2
    steps = np.arange(1.0, low + 1)
    with np.errstate(under="ignore"):
        weights = np.cumprod(np.append(1.0, (low - steps + 1) / (high + steps)))
        sums = np.cumsum(weights[::-1])
    return np.asarray(sums / (2 * sums[-1] - (low == high)))


def mcnemar(first: int, second: int) -> float:
    """Return the two-sided p-value of McNemar's exact test.

    `first` and `second` count the discordant pairs, with a single success of the first or of the
    second. Under equal success rates both kinds have probability 1/2, so that

        p = min(1, 2 P(X <= min(first, second))), X ~ Bin(first + second, 1/2)

    (McNemar 1947, "Note on the sampling error of the difference between correlated proportions or
    percentages").

    >>> round(mcnemar(12, 2), 4)
    0.0129
    """
    tail = half_binomial(first + second)[min(first, second)]
    return min(1.0, 2.0 * float(tail))


def paired_difference(
    both: int, first: int, second: int, neither: int, level: float = 0.95
) -> Estimate:
    """Return the difference of two shares of the same pairs, with the interval of Newcombe.

    The interval is Newcombe's method 10 (1998, "Improved confidence intervals for the difference
    between binomial proportions based on paired data", Statistics in Medicine 17, 2635), with the
    ends l, u of the Wilson intervals of p1 and p2, and the continuity-corrected correlation phi of
    the pairs:

        p1 - p2 - sqrt((p1 - l1)^2 - 2 phi (p1 - l1) (u2 - p2) + (u2 - p2)^2)
        p1 - p2 + sqrt((u1 - p1)^2 - 2 phi (u1 - p1) (p2 - l2) + (p2 - l2)^2)

    Without pairs the number is NaN and the interval -1 to 1.

    >>> paired_difference(59, 6, 16, 80).text(".4f")
    '-0.0621 [-0.1186, -0.0046]'
    """
    n = both + first + second + neither
    if not n:
        return Estimate(math.nan, -1.0, 1.0, 0)
    one, two = estimate_share(both + first, n, level), estimate_share(both + second, n, level)
    phi = _phi_coefficient(both, first, second, neither)
    down = _newcombe_distance(one.value - one.low, two.high - two.value, phi)
    up = _newcombe_distance(one.high - one.value, two.value - two.low, phi)
    middle = (first - second) / n
    return Estimate(middle, max(middle - down, -1.0), min(middle + up, 1.0), n)


def _phi_coefficient(both: int, first: int, second: int, neither: int) -> float:
    """Return phi of a fourfold table, corrected for continuity; 0 if a margin is zero."""
    n, excess = both + first + second + neither, both * neither - first * second
    sides = (both + first) * (second + neither) * (both + second) * (first + neither)
    corrected = max(excess - n / 2, 0.0) if excess > 0 else float(excess)
    return corrected / math.sqrt(sides) if sides else 0.0


def _newcombe_distance(a: float, b: float, phi: float) -> float:
    """Return sqrt(a^2 - 2 phi a b + b^2), the distance of an end of the interval."""
    return math.sqrt(max(a * a - 2 * phi * a * b + b * b, 0.0))


def median_interval(values: Array, level: float = 0.95) -> Estimate:
    """Return the median of values (n,) with a distribution-free interval.

    The ends are the k-th smallest and the k-th largest value, with the largest k that satisfies 2
    P(X < k) <= 1 - level, X ~ Bin(n, 1/2): the interval of the sign test (David and Nagaraja 2003,
    "Order Statistics", section 7.1). Its coverage is at least the level. The interval is infinite
    for too few values, below 6 at 0.95.

    >>> median_interval(np.arange(1.0, 11.0)).text("g")
    '5.5 [2, 9]'
    """
    check_level(level)
    ordered, n = np.sort(values), len(values)
    if not n:
        return Estimate(math.nan, -math.inf, math.inf, 0)
    k = int(np.searchsorted(half_binomial(n), (1 - level) / 2, side="right"))
    ends = (float(ordered[k - 1]), float(ordered[n - k])) if k else (-math.inf, math.inf)
    return Estimate(float(np.median(ordered)), *ends, n)
