"""Robust weights: how far marks are believed, from how far they are from where they should be.

An M-estimate makes a sum of rho(r / sigma) least, which is to weigh squares by w = rho'(u) / u at
u = r / sigma (iteratively reweighted least squares; Holland and Welsch 1977). The constants give
95 percent of the efficiency of least squares where errors are Gaussian and no mark lies.
"""

import numpy as np

from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import floor, get, put, sqrt, where
from robsim.kernels.machine.stages import stage

HUBER, TUKEY, CAUCHY = 0, 1, 2
HUBER_THRESHOLD, TUKEY_THRESHOLD, CAUCHY_SCALE = 1.345, 4.685, 2.385
NORMAL_SCALE = 1.482602218505602  # 1 / Phi^-1(3/4): a standard deviation over the median deviation
NO_DISTANCE = 1e300  # what counts as the distance of a mark that is not seen
LEAST_WEIGHT = 1e-3  # weight: an error of 100 px counts as one of 0.1 px


@part
def _robust_weight(kind, u):
    """Return the weight of residuals u >= 0 over their scale; 0 where they are NaN.

    Huber 1964: 1 up to c, then c / u. Tukey's biweight (Beaton and Tukey 1974): (1 - (u/c)^2)^2 up
    to c, then 0. Cauchy: 1 / (1 + (u/c)^2).
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
    """Let the lower of two rows stand in the first of them, lane by lane."""
    low, high = get(w, a), get(w, b)
    right = low <= high
    put(w, a, where(right, low, high))
    put(w, b, where(right, high, low))


@kernel
def sort_rows(w, first, n):
    """Sort n rows by Batcher's merge exchange (Knuth, volume 3, 5.2.2 M), the same in all lanes."""
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
    """Return the median of the lowest `count` of n rows, lane by lane; the rows are sorted."""
    sort_rows(w, first, n)
    low, high = floor(0.5 * (count - 1.0)), floor(0.5 * count)
    found = 0.0 * count
    for i in range(n):
        row = 0.5 * get(w, first + i)
        found = found + where(low == 1.0 * i, row, 0.0) + where(high == 1.0 * i, row, 0.0)
    return found


@kernel
def put_robust_weights(w, kind, N, distances, least, out):
    """Compute the weights of N marks from how far they are from where they should be.

    Their scale is 1.4826 times the median distance, as distances from a fit deviate from 0, and at
    least the row `least`: where all fits well, small distances say nothing. A distance that is not
    a number, of a mark that is not seen, does not count, and its weight is 0.
    """
    count = 0.0 * get(w, least)
    for n in range(N):
        r = get(w, distances + n)
        count = count + where(r < NO_DISTANCE, 1.0, 0.0)
        put(w, out + n, where(r < NO_DISTANCE, r, NO_DISTANCE))
    scale, least_scale = NORMAL_SCALE * _median_of_lowest(w, out, N, count), get(w, least)
    scale = where(scale > least_scale, scale, least_scale)
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
    there="N",
    least="row",
    weights="N",
    room="3*N",
):
    """Compute weights of N marks by the distances of their pixels from those at the goal.

    (kind, N, pixels, goal, whether they are there, least scale, weights, room of 3 N rows). None of
    them is less than LEAST, so that marks that seem to lie are there still.
    """
    for n in range(N):
        here = where(get(w, there + n) > 0.0, 0.0, np.nan)
        for i in range(2 * n, 2 * n + 2):
            put(w, room + i, (get(w, pixels + i) - get(w, goal + i)) + here)
    put_distances(w, N, room, room + 2 * N)
    put_robust_weights(w, kind, N, room + 2 * N, least, weights)
    for n in range(N):
        weight = get(w, weights + n)
        put(w, weights + n, where(weight > LEAST_WEIGHT, weight, LEAST_WEIGHT))
