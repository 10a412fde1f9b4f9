"""Association of two columns: rank correlation and correlation ratio, with intervals."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import check_level, normal_quantile

FEWEST = 5  # least number of independent values for an interval
EXACT = 1e-12  # distance from 1 below which a correlation is exact


def ranks(values: Array) -> Array:
    """Return the ranks (n,) of values, from 1; equal values share their mean rank.

    >>> ranks(np.array([10.0, 30.0, 10.0]))
    array([1.5, 3. , 1.5])
    """
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - (counts - 1) / 2)[place])


def spearman(x: Array, y: Array, level: float = 0.95) -> Estimate:
    """Return Spearman's rank correlation of x and y (n,), with its interval.

    The interval uses Fisher's z = artanh(rho) with the standard deviation sqrt((1 + rho^2 / 2) / (n
    - 3)) (Bonett and Wright 2000, "Sample size requirements for estimating Pearson, Kendall and
    Spearman correlations", Psychometrika 65, 23), or the standard deviation of the delta method,
    sd(a b - rho (a^2 + b^2) / 2) / ((1 - rho^2) sqrt(n)) for standardised ranks a and b, if it is
    larger. The former holds for elliptic distributions and is too small for curved dependences.
    Neither x nor y may be constant.

    >>> spearman(np.arange(20.0), np.arange(20.0) ** 2).value
    1.0
    """
    n, quantile = len(x), normal_quantile(level)
    a, b = _standardise(ranks(x)), _standardise(ranks(y))
    rho = float(np.clip((a * b).mean(), -1.0, 1.0))
    if n < FEWEST:
        return Estimate(rho, -1.0, 1.0, n)
    if abs(rho) > 1 - EXACT:
        end = float(round(rho))
        return Estimate(end, end, end, n)
    scatter = float((a * b - rho * (a * a + b * b) / 2).std())
    half_width = quantile * max(
        _fisher_z_deviation(rho * rho, n), scatter / ((1 - rho * rho) * math.sqrt(n))
    )
    z = math.atanh(rho)
    return Estimate(rho, math.tanh(z - half_width), math.tanh(z + half_width), n)


def _standardise(values: Array) -> Array:
    """Return values (n,) with mean 0 and variance 1."""
    deviations = values - values.mean()
    return np.asarray(deviations / math.sqrt((deviations * deviations).mean()))


def _fisher_z_deviation(square: float, n: int) -> float:
    """Return the standard deviation of artanh(rho) of a rank correlation with a given square."""
    return math.sqrt((1 + square / 2) / (n - 3))


def correlation_ratio(groups: NDArray[np.intp], y: Array, level: float = 0.95) -> Estimate:
    """Return the correlation ratio eta of the ranks of y (n,) on groups (n,), with its interval.

    eta^2 is the share of the variance of the ranks between the groups. The raw share is H / (n -
    1), with the H of Kruskal and Wallis (1952), and is positive by chance alone. Corrected for n
    values in k groups (Kelley 1935, "An unbiased correlation ratio measure"), it is

        eta^2 = 1 - (1 - H / (n - 1)) (n - 1) / (n - k)

    or 0 if this is negative. The interval contains every eta under which the raw share is likely. H
    has a noncentral chi-squared distribution with k - 1 degrees of freedom (Andrews 1954); here
    artanh^2(sqrt(H / (n - 1))) / s^2 has this distribution, on the scale of Fisher's z. s is the
    larger of the standard deviations of `spearman` and of the delta method, which accounts for the
    scatter of the ranks within the groups. y may not be constant.

    >>> correlation_ratio(np.arange(40) % 2, np.arange(40.0) % 2).value
    1.0
    """
    n, alpha = len(y), (1 - check_level(level)) / 2
    k, raw, scatter = _variance_between_groups(groups, ranks(y))
    if n - k < FEWEST:
        return Estimate(math.sqrt(raw), 0.0, 1.0, n)
    eta = math.sqrt(max(1 - (1 - raw) * (n - 1) / (n - k), 0.0))
    if raw == 1.0:
        return Estimate(1.0, 1.0, 1.0, n)
    delta = scatter / (2 * math.sqrt(raw) * (1 - raw) * math.sqrt(n)) if raw else 0.0
    scale = max(_fisher_z_deviation(raw, n), delta)
    statistic = (math.atanh(math.sqrt(raw)) / scale) ** 2
    low, high = (_noncentrality(statistic, k - 1, share) for share in (1 - alpha, alpha))
    limits = [math.tanh(math.sqrt(each) * scale) for each in (low, high)]
    return Estimate(eta, min(limits[0], eta), max(limits[1], eta), n)


def _variance_between_groups(groups: NDArray[np.intp], values: Array) -> tuple[int, float, float]:
    """Return the number of groups, the share of the variance between them, and its deviation.

    The third value is the standard deviation of the influence function of the share. For values
    with mean 0 and variance 1, and the mean m of a value's group, the influence of a value is 2
    value m - m^2 - share value^2.
    """
    _, place, counts = np.unique(groups, return_inverse=True, return_counts=True)
    deviations = _standardise(values)
    means = (np.bincount(place, deviations) / counts)[place]
    share = float((means * means).mean())
    influence = (2 * deviations - means) * means - share * deviations * deviations
    return len(counts), 1.0 if share > 1 - EXACT else share, float(influence.std())


def _noncentrality(statistic: float, freedom: int, share: float) -> float:
    """Return the noncentrality of a chi-squared variable that is below `statistic`.

    The variable is below it with probability `share`. The result is 0 if a central variable is
    below it with a smaller probability.
    """
    z = NormalDist().inv_cdf(share)
    low, high = 0.0, (math.sqrt(statistic) + abs(z) + freedom + 3) ** 2
    if _normal_score(statistic, freedom, low) < z:
        return 0.0
    for _ in range(60):  # bisection to the last digits
        middle = (low + high) / 2
        above = _normal_score(statistic, freedom, middle) > z
        low, high = (middle, high) if above else (low, middle)
    return low


def _normal_score(statistic: float, freedom: int, noncentrality: float) -> float:
    """Return the standard normal quantile with the probability of a noncentral chi squared.

    Sankaran 1963, "Approximations to the non-central chi-square distribution", Biometrika 50, 199:
    the h-th power of the number is nearly normal.
    """
    mean, twice = freedom + noncentrality, freedom + 2 * noncentrality
    h = 1 - 2 / 3 * mean * (freedom + 3 * noncentrality) / twice**2
    p, m = twice / mean**2, (h - 1) * (1 - 3 * h)
    centre = 1 + h * p * (h - 1 - 0.5 * (2 - h) * m * p)
    spread = h * math.sqrt(2 * p) * (1 + 0.5 * m * p)
    return float((statistic / mean) ** h - centre) / spread
