"""Shares of runs with confidence intervals."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import as_integer
from robsim.base.errors import InputError, format_value
from robsim.statistics.estimate import Estimate


def estimate_share(
    count: int, of: int, level: float = 0.95, *, independent: float | None = None
) -> Estimate:
    """Return a share with its Wilson score interval.

    With p = count / of and the quantile z of the normal distribution for the level, the interval is

        (p + z^2 / 2n -+ z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 + z^2 / n)

    (Wilson 1927, "Probable inference, the law of succession, and statistical inference"). It stays
    within 0 and 1, and is valid for shares of 0 and 1 too. Without values it is 0 to 1. For
    dependent values, n is the effective number of `independent` values. Raises InputError if count
    exceeds `of`, or the level is not between 0 and 1.

    >>> str(estimate_share(8, 10))
    '80.0 % [49.0, 94.3]'
    """
    of, z = as_integer(of, "of", 0), normal_quantile(level)
    count = as_integer(count, "count", 0, of + 1)
    if not of:
        return Estimate(math.nan, 0.0, 1.0, 0, "%")
    n = float(of) if independent is None else independent
    p, spread = count / of, z * z / n
    middle, half = p + spread / 2, z * math.sqrt(p * (1 - p) / n + spread / (4 * n))
    low, high = (middle - half) / (1 + spread), (middle + half) / (1 + spread)
    ends = max(low, 0.0) if count else 0.0, high if count < of else 1.0
    return Estimate(p, *ends, of, "%")


def estimate_clustered_share(
    success: NDArray[np.bool_], draw: NDArray[Any], level: float = 0.95
) -> Estimate:
    """Return the share of successful runs (n,), with several dependent runs of each draw.

    The interval uses the number of independent runs with the same variance as the ratio estimator
    over draws, sum_d (x_d - p n_d)^2 m / (m - 1) / n^2, with x_d successes of n_d runs in m draws
    (Kish 1965, "Survey sampling"; Korn and Graubard 1998, "Confidence intervals for proportions
    with small expected number of positive counts estimated from survey data"). This number is at
    least 1 and at most n; it is the number of draws if all runs or none succeed.

    >>> str(estimate_clustered_share(np.array([True, True, False, False]), np.array([0, 0, 1, 1])))
    '50.0 % [5.5, 94.5]'
    """
    n, count = len(success), int(success.sum())
    _, place = np.unique(draw, return_inverse=True)
    runs = np.bincount(place)
    if len(runs) == n or not n:
        return estimate_share(count, n, level)
    p = count / n
    deviations = np.bincount(place, success.astype(float)) - p * runs
    m = len(runs)
    variance = float((deviations * deviations).sum()) * m / max(m - 1, 1) / n**2
    effective = p * (1.0 - p) / variance if variance > 0.0 and 0.0 < p < 1.0 else float(m)
    return estimate_share(count, n, level, independent=min(max(effective, 1.0), float(n)))


def normal_quantile(level: float) -> float:
    """Return z such that a standard normal number is between -z and z with probability `level`."""
    return NormalDist().inv_cdf(0.5 + check_level(level) / 2)


def check_level(level: float) -> float:
    """Return the level of an interval; raise InputError unless it is between 0 and 1."""
    if isinstance(level, bool) or not isinstance(level, int | float) or not 0 < level < 1:
        raise InputError(f"level: expected a number above 0 and below 1, got {format_value(level)}")
    return level
