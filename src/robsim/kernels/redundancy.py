"""Redundancy: projectors onto the motions that a task leaves free, with the run last.

Rank is decided once for each direction, by singular values relative to the largest of the task's
own matrix A. What a task of higher priority left of it, A P, may be nothing but rounding, and a
threshold relative to A P would invert that.
"""

import math

import numpy as np

from robsim.kernels.extremes import largest
from robsim.kernels.jit import kernel, part
from robsim.kernels.singular import singular_values
from robsim.kernels.solve import product


@kernel
def switch(x, low, high):
    """Return w: 0 up to low, 1 from high on, between them a sigmoid scaled to meet both ends.

    With u = (x - low)/(high - low), sig(u) = 1/(1 + exp(6 - 12 u)), this is
    (sig(u) - sig(0))/(sig(1) - sig(0)), since sig = (1 + tanh(6 u - 3))/2.
    """
    if x <= low:
        return 0.0
    if x >= high:
        return 1.0
    return 0.5 + 0.5 * math.tanh(6.0 * (x - low) / (high - low) - 3.0) / math.tanh(3.0)


@kernel
def large_projection(A, e, low, high, P):
    """Replace the projector P by w (I - A'e e'A/(e'A A'e)) + (1 - w) P, w = switch(||e||).

    At first P[n, n, b] is the projector of A[k, n, b] itself; e is [k, b]. Where A'e is zero but
    for rounding, w is 0.
    """
    n, runs = A.shape[1], A.shape[2]
    u, square, most, norm = np.zeros((n, runs)), np.zeros(runs), np.zeros(runs), np.zeros(runs)
    for i in range(A.shape[0]):
        for b in range(runs):
            norm[b] += e[i, b] * e[i, b]
        for j in range(n):
            for b in range(runs):
                u[j, b] += A[i, j, b] * e[i, b]
                most[b] += A[i, j, b] * A[i, j, b]
    for j in range(n):
        for b in range(runs):
            square[b] += u[j, b] * u[j, b]
    for b in range(runs):
        w = switch(math.sqrt(norm[b]), low, high)
        if square[b] <= 1e-24 * most[b] * norm[b]:
            w, square[b] = 0.0, 1.0
        for i in range(n):
            for j in range(n):
                free = (1.0 if i == j else 0.0) - u[i, b] * u[j, b] / square[b]
                P[i, j, b] = w * free + (1.0 - w) * P[i, j, b]


@part
def _rest(A, rate, qd, out):
    """Compute out = rate - A qd."""
    for i in range(A.shape[0]):
        for b in range(A.shape[2]):
            out[i, b] = rate[i, b]
        for j in range(A.shape[1]):
            for b in range(A.shape[2]):
                out[i, b] -= A[i, j, b] * qd[j, b]


@part
def _take(direction, along, taken, free, square, qd, P):
    """Add `along` times the free part P direction to qd, and remove that direction from P.

    Only in the runs whose `taken` is 1. The direction lies in the range of P but for rounding;
    projecting it once more keeps what was taken before undisturbed even where the motion is large,
    near a conflict.
    """
    free[:], square[:] = 0.0, 0.0
    n, runs = free.shape
    for i in range(n):
        for j in range(n):
            for b in range(runs):
                free[i, b] += P[i, j, b] * direction[j, b]
        for b in range(runs):
            square[b] += free[i, b] * free[i, b]
    for i in range(n):
        for b in range(runs):
            qd[i, b] += free[i, b] * along[b] if taken[b] else 0.0
        for j in range(n):
            for b in range(runs):
                P[i, j, b] -= free[i, b] * free[j, b] / square[b] if taken[b] else 0.0


@kernel
def descend(A, rate, rcond, first, qd, P):
    """Add (A P)^+ (rate - A qd) to qd[n, b], and subtract (A P)^+ A P from P[n, n, b].

    The shapes are A[k, n, b] and rate[k, b]. Singular values of A P below rcond times the largest
    of A count as zero. `first` says that P is the identity, and qd zero.
    """
    k, n, runs = A.shape
    small = min(k, n)
    G, V = np.empty((max(k, n), small, runs)), np.empty((small, small, runs))
    sigma, least = np.empty((small, runs)), np.empty(runs)
    free, along, square = np.empty((n, runs)), np.empty(runs), np.empty(runs)
    taken, AP, rest = np.empty(runs, np.bool_), np.empty(A.shape), np.empty(rate.shape)
    singular_values(A, G, V, sigma)
    largest(sigma, least)
    if not first:
        product(A, P, AP)
        singular_values(AP, G, V, sigma)
    _rest(A, rate, qd, rest)
    left, right = (V, G) if k < n else (G, V)  # A P = left right', one of them orthonormal
    for s in range(small):
        along[:] = 0.0
        for i in range(k):
            for b in range(runs):
                along[b] += left[i, s, b] * rest[i, b]
        for b in range(runs):
            taken[b] = sigma[s, b] > rcond * least[b]
            along[b] /= sigma[s, b] * sigma[s, b]
        _take(right[:, s], along, taken, free, square, qd, P)
    largest(sigma, square)
    for b in range(runs):
        if not math.isfinite(least[b] + square[b]):
            qd[:, b], P[:, :, b] = np.nan, np.nan
