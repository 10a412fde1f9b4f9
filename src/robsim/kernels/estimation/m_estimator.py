"""M-estimators: robust weights of marks from the distances to their expected points.

An M-estimator minimises a sum of rho(r / sigma). This is equivalent to least squares with weights
w = rho'(u) / u at u = r / sigma (iteratively reweighted least squares; Holland and Welsch 1977).
The constants give 95 percent of the efficiency of least squares for Gaussian errors without
outliers.
"""

import numpy as np

from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import floor, get, put, sqrt, where
from robsim.kernels.machine.stages import stage

HUBER, TUKEY, CAUCHY = 0, 1, 2
HUBER_THRESHOLD, TUKEY_THRESHOLD, CAUCHY_SCALE = 1.345, 4.685, 2.385
NORMAL_SCALE = (
    1.482602218505602  # 1 / Phi^-1(3/4): standard deviation / median deviation, if Gaussian
)
NO_DISTANCE = 1e300  # distance of an unmeasured mark
LEAST_WEIGHT = 1e-3  # of an outlier: its error of 100 px has the effect of 0.1 px


@part
def _robust_weight(kind, u):
    """Return the weight of scaled residuals u >= 0; 0 if u is NaN.

    Huber 1964: 1 for u <= c, else c / u. Tukey's biweight (Beaton and Tukey 1974):
    (1 - (u/c)^2)^2 for u <= c, else 0. Cauchy: 1 / (1 + (u/c)^2).
    """
    if kind == HUBER:
        return where(
            u <= HUBER_THRESHOLD, 1.0, where(u > HUBER_THRESHOLD, HUBER_THRESHOLD / u, 0.0)
        )
    if kind == TUKEY:
        share = u * (1.0 / TUKEY_THRESHOLD)
        rest = 1.0 - share * share
        return where(share < 1.0, rest * rest, 0.0)
    share = u * (1.0 / CAUCHY_SCALE)
    return where(share >= 0.0, 1.0 / (1.0 + share * share), 0.0)


@part
def _sort_pair(w, a, b):
    """Sort two rows in ascending order, lane by lane."""
    low, high = get(w, a), get(w, b)
    right = low <= high
    put(w, a, where(right, low, high))
    put(w, b, where(right, high, low))


@kernel
def sort_rows(w, first, n):
    """Sort n rows in each lane by Batcher's merge exchange (Knuth, volume 3, 5.2.2 M)."""
    top = 1
    while 2 * top < n:
        top *= 2
    p = top
    while p > 0:
        q, r, d = top, 0, p
        while d > 0:
            for i in range(n - d):
                if (i & p) == r:
                    _sort_pair(w, first + i, first + i + d)
            d, r = q - p, p
            q //= 2
        p //= 2


@part
def _median_of_lowest(w, first, n, count):
    """Sort n rows and return the median of the lowest `count` rows, lane by lane."""
    sort_rows(w, first, n)
    low, high = floor(0.5 * (count - 1.0)), floor(0.5 * count)
    median = 0.0 * count
    for i in range(n):
        row = 0.5 * get(w, first + i)
        median = median + where(low == 1.0 * i, row, 0.0) + where(high == 1.0 * i, row, 0.0)
    return median


@kernel
def put_robust_weights(w, kind, N, distances, least_scale, out):
    """Compute the weights of N marks from the distances to their expected points.

    The scale is 1.4826 times the median distance, and at least the row `least_scale`. This lower
    bound prevents small weights if all marks fit well. An unmeasured mark has the distance NaN. It
    does not enter the median, and its weight is 0.
    """
    count = 0.0 * get(w, least_scale)
    for n in range(N):
        r = get(w, distances + n)
        count = count + where(r < NO_DISTANCE, 1.0, 0.0)
        put(w, out + n, where(r < NO_DISTANCE, r, NO_DISTANCE))
    scale, bound = NORMAL_SCALE * _median_of_lowest(w, out, N, count), get(w, least_scale)
    scale = where(scale > bound, scale, bound)
    for n in range(N):
        put(w, out + n, _robust_weight(kind, get(w, distances + n) / scale))


@part
def put_distances(w, N, errors, out):
    """Compute the lengths of N vectors of two rows each."""
    for n in range(N):
        x, y = get(w, errors + 2 * n), get(w, errors + 2 * n + 1)
        put(w, out + n, sqrt(x * x + y * y))


@stage
def weight_by_distance(
    w,
    step,
    kind="whole",
    N="count",
    pixels="N, 2",
    goal="N, 2",
    present="N",
    least_scale="row",
    weights="N",
    scratch="3*N",
):
    """Compute weights of N marks from the distances between their pixels and the goal pixels.

    `present` is 1 for measured marks, and `least_scale` is the lower bound of the scale. The weight
    of an outlier is LEAST_WEIGHT, not 0, so the outlier remains among the marks in use.
    """
    for n in range(N):
        here = where(get(w, present + n) > 0.0, 0.0, np.nan)
        for i in range(2 * n, 2 * n + 2):
            put(w, scratch + i, (get(w, pixels + i) - get(w, goal + i)) + here)
    put_distances(w, N, scratch, scratch + 2 * N)
    put_robust_weights(w, kind, N, scratch + 2 * N, least_scale, weights)
    for n in range(N):
        weight = get(w, weights + n)
        put(w, weights + n, where(weight > LEAST_WEIGHT, weight, LEAST_WEIGHT))
