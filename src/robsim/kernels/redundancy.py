"""Redundancy: projectors onto the motions that a task leaves free.

Rank is decided once for each direction, by singular values relative to the largest of the task's
own matrix A. What a task of higher priority left of it, A P, may be nothing but rounding, and a
threshold relative to A P would invert that.
"""

import math

import numpy as np

from robsim.kernels import singular
from robsim.kernels.jit import kernel, part
from robsim.kernels.lanes import WIDTH, get, put, where
from robsim.kernels.memory import matrix, vector
from robsim.kernels.singular import decompose, greatest
from robsim.kernels.stage import stage


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
def _rest(w, A, k, n, rate, qd, out):
    """Compute out = rate - A qd."""
    for i in range(k):
        total = get(w, rate + i)
        for j in range(n):
            total = total - get(w, A + n * i + j) * get(w, qd + j)
        put(w, out + i, total)


@part
def _take(w, direction, along, taken, n, free, qd, P):
    """Add `along` times the free part P direction to qd, and remove that direction from P.

    Only in the runs that are `taken`. The direction lies in the range of P but for rounding;
    projecting it once more keeps what was taken before undisturbed even where the motion is large,
    near a conflict.
    """
    square = 0.0 * along
    for i in range(n):
        total = 0.0 * along
        for j in range(n):
            total = total + get(w, P + n * i + j) * get(w, direction + j)
        put(w, free + i, total)
        square = square + total * total
    for i in range(n):
        here = get(w, free + i)
        put(w, qd + i, get(w, qd + i) + where(taken, here * along, 0.0))
        for j in range(n):
            less = where(taken, here * get(w, free + j) / square, 0.0)
            put(w, P + n * i + j, get(w, P + n * i + j) - less)


@kernel
def _columns(w, A, k, n, G):
    """Copy A or A', whichever is tall, column by column."""
    p = max(k, n)
    for j in range(min(k, n)):
        for i in range(p):
            put(w, G + j * p + i, get(w, A + (j * n + i if k < n else i * n + j)))


def scratch_of(k: int, n: int) -> int:
    """Return how many rows `descend` needs to work in."""
    return singular.scratch_of(k, n) + k + n + k * n


@stage
def descend(p, w, step):
    """Add (A P)^+ (rate - A qd) to qd (n,), and subtract (A P)^+ A P from P (n, n).

    (A, k, n, rate, rcond, whether first, qd, P, scratch). Singular values of A P below rcond times
    the largest of A count as zero. `first` says that P is to be the identity, and qd zero.
    """
    A, k, n, rate, rcond, qd, P = p[0], p[1], p[2], p[3], get(w, p[4]), p[6], p[7]
    m, tall = min(k, n), max(k, n)
    G = p[8]
    V, sigma = G + tall * m, G + tall * m + m * m
    rest, free = sigma + m, sigma + m + k
    _columns(w, A, k, n, G)
    decompose(w, G, tall, m, V, sigma)
    most = _greatest(w, sigma, m)
    total = most
    if p[5]:
        for i in range(n):
            put(w, qd + i, 0.0)
            for j in range(n):
                put(w, P + n * i + j, 1.0 if i == j else 0.0)
    else:
        AP = free + n
        for i in range(k):
            for j in range(n):
                total = 0.0 * most
                for c in range(n):
                    total = total + get(w, A + n * i + c) * get(w, P + n * c + j)
                put(w, AP + n * i + j, total)
        _columns(w, AP, k, n, G)
        decompose(w, G, tall, m, V, sigma)
        total = most + _greatest(w, sigma, m)
    _rest(w, A, k, n, rate, qd, rest)
    left, height, right, width = (V, m, G, tall) if k < n else (G, tall, V, m)
    for s in range(m):  # A P = left right', one of them orthonormal
        along = 0.0 * most
        for i in range(k):
            along = along + get(w, left + height * s + i) * get(w, rest + i)
        size = get(w, sigma + s)
        taken = size > rcond * most
        _take(w, right + width * s, along / (size * size), taken, n, free, qd, P)
    broken = ~(total * 0.0 == 0.0)
    for i in range(n):
        put(w, qd + i, where(broken, np.nan, get(w, qd + i)))
        for j in range(n):
            put(w, P + n * i + j, where(broken, np.nan, get(w, P + n * i + j)))


@part
def _greatest(w, x, n):
    """Return the largest of n numbers; NaN or infinite if any of them is."""
    total = 0.0 * get(w, x)
    for i in range(1, n):
        total = total + 0.0 * get(w, x + i)
    return greatest(w, x, n) + total


@stage
def large_stage(p, w, step):
    """Replace a projector by the large one: (A, k, n, error, bounds of ||e||, P)."""
    A, e, P = matrix(w, p[0], p[1], p[2]), vector(w, p[3], p[1]), matrix(w, p[5], p[2], p[2])
    large_projection(A, e, w[p[4] * WIDTH], w[(p[4] + 1) * WIDTH], P)


@stage
def wish_stage(p, w, step):
    """Compute gain (q within bounds - q): (n, gain, lowest, highest, wish), and the rows of q.

    A velocity without a coordinate of its own, -1, has q = 0.
    """
    n, gain, low, high = p[0], get(w, p[1]), p[2], p[3]
    for i in range(n):
        x = get(w, p[5 + i]) if p[5 + i] >= 0 else 0.0 * gain
        within = where(x < get(w, low + i), get(w, low + i), x)
        within = where(within > get(w, high + i), get(w, high + i), within)
        put(w, p[4] + i, gain * (within - x))


@stage
def project_stage(p, w, step):
    """Compute out = qd + P wish: (n, P, wish, qd, out)."""
    n, P = p[0], p[1]
    for i in range(n):
        total = 0.0 * get(w, P)
        for j in range(n):
            total = total + get(w, P + n * i + j) * get(w, p[2] + j)
        put(w, p[4] + i, get(w, p[3] + i) + total)


@stage
def smooth_stage(p, w, step):
    """Compute qd - exp(-mu t) qd(0): (n, mu, dt, first, qd, out)."""
    for i in range(WIDTH):
        left = math.exp(-w[p[1] * WIDTH + i] * (step * w[p[2] * WIDTH + i]))
        for j in range(p[0]):
            at = j * WIDTH + i
            if step == 0:
                w[p[3] * WIDTH + at] = w[p[4] * WIDTH + at]
            w[p[5] * WIDTH + at] = w[p[4] * WIDTH + at] - left * w[p[3] * WIDTH + at]
