"""Null-space motions, the large projector, and the smooth start of a command."""

import math

import numpy as np

from robsim.kernels.control.free_motions import project_motion
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH, get, put, where
from robsim.kernels.machine.stages import stage


@kernel
def sigmoid_switch(x, low, high):
    """Return the weight w: 0 for x <= low, 1 for x >= high, and a scaled sigmoid in between.

    With u = (x - low)/(high - low), sig(u) = 1/(1 + exp(6 - 12 u)), this is
    (sig(u) - sig(0))/(sig(1) - sig(0)), since sig = (1 + tanh(6 u - 3))/2.
    """
    if x <= low:
        return 0.0
    if x >= high:
        return 1.0
    return 0.5 + 0.5 * math.tanh(6.0 * (x - low) / (high - low) - 3.0) / math.tanh(3.0)


@kernel
def blend_large_projector(A, e, low, high, P):
    """Replace the projector P by w (I - A'e e'A/(e'A A'e)) + (1 - w) P, with a weight w of ||e||.

    The weight is w = `sigmoid_switch(||e||, low, high)`. If A'e is zero up to
    rounding, w is 0. On entry P[n, n, b] is the projector onto the null space of A[k, n, b]. e has
    the shape [k, b].
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
        w = sigmoid_switch(math.sqrt(norm[b]), low, high)
        if square[b] <= 1e-24 * most[b] * norm[b]:
            w, square[b] = 0.0, 1.0
        for i in range(n):
            for j in range(n):
                free = (1.0 if i == j else 0.0) - u[i, b] * u[j, b] / square[b]
                P[i, j, b] = w * free + (1.0 - w) * P[i, j, b]


@stage
def apply_large_projector(w, step, A="k, n", k="count", n="count", error="k", bounds="2", P="n, n"):
    """Replace the projector P by the large projector. The bounds of ||e|| are low and high."""
    A, e, P = matrix(w, A, k, n), vector(w, error, k), matrix(w, P, n, n)
    blend_large_projector(A, e, w[bounds * WIDTH], w[(bounds + 1) * WIDTH], P)


@stage
def compute_limit_avoidance(
    w, step, n="count", gain="row", lowest="n", highest="n", motion="n", q="each: row or none"
):
    """Compute the secondary motion gain (clip(q, lowest, highest) - q).

    A velocity without a coordinate (q = -1) has q = 0.
    """
    gain, low, high = get(w, gain), lowest, highest
    for i in range(n):
        x = get(w, q[1 + i]) if q[1 + i] >= 0 else 0.0 * gain
        within = where(x < get(w, low + i), get(w, low + i), x)
        within = where(within > get(w, high + i), get(w, high + i), within)
        put(w, motion + i, gain * (within - x))


@stage
def add_projected_motion(w, step, n="count", P="n, n", motion="n", qd="n", out="n"):
    """Add a secondary motion, projected by P into the null space, to the command qd."""
    for i in range(n):
        put(w, out + i, get(w, qd + i) + project_motion(w, n, P, motion, i))


@stage
def smooth_start_command(w, step, n="count", mu="row", dt="row", initial="n", qd="n", out="n"):
    """Compute out = qd - exp(-mu t) qd(0). The rows `initial` store qd(0)."""
    for i in range(WIDTH):
        left = math.exp(-w[mu * WIDTH + i] * (step * w[dt * WIDTH + i]))
        for j in range(n):
            at = j * WIDTH + i
            if step == 0:
                w[initial * WIDTH + at] = w[qd * WIDTH + at]
            w[out * WIDTH + at] = w[qd * WIDTH + at] - left * w[initial * WIDTH + at]
