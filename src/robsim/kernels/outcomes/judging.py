"""Stages that judge whether and why each run of a block ends, from one instant.

Where several reasons hold, the first of this order is given: a state that is not finite, a joint
limit, a mark behind the camera, a mark out of the image, convergence, divergence, a command that
is not finite, a stall (a singularity if L J has lost rank, else a local minimum), the end of time.
"""

import numpy as np

from robsim.kernels.formulas import camera
from robsim.kernels.linear_algebra.singular import truncated
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import absolute, get, put, some, sqrt, where
from robsim.kernels.machine.stage import stage
from robsim.kernels.outcomes.endings import (
    BEHIND_CAMERA,
    CONVERGED,
    DIVERGED,
    DIVERGENCE,
    JOINT_LIMIT,
    LOCAL_MINIMUM,
    NOT_FINITE,
    OUT_OF_IMAGE,
    RUNNING,
    SINGULAR,
    STALL,
    STALL_PERIODS,
    TIME_LIMIT,
)


@part
def _larger(most, x):
    """Return the larger of `most` and |x|; NaN if either is NaN or |x| infinite."""
    size = absolute(x)
    return where(size > most, size, most) + size * 0.0


@part
def _most(w, x, n, zero):
    """Return the largest |x|; NaN if any of them is NaN or infinite."""
    most = zero
    for i in range(n):
        most = _larger(most, get(w, x + i))
    return most


@stage
def errors(p, w, step):
    """Compute the largest |error| in units of the first tolerance, and its norm.

    (k, error, scale, size, norm)
    """
    most = 0.0 * get(w, p[2])
    square = most
    for i in range(p[0]):
        error = get(w, p[1] + i) * get(w, p[2] + i)
        most, square = _larger(most, error), square + error * error
    put(w, p[3], most)
    put(w, p[4], sqrt(square))


@stage
def stillness(p, w, step):
    """Count the periods in which the command hardly moves the features over 1/pace.

    (A, k, n, qd, scale, pace, tolerance, count)
    """
    A, k, n, qd, scale = p[0], p[1], p[2], p[3], p[4]
    least = (STALL * get(w, p[6])) * get(w, p[5])
    most = 0.0 * get(w, scale)
    for i in range(k):
        change = 0.0 * get(w, scale)
        for j in range(n):
            change = change + (get(w, A + n * i + j) * get(w, scale + i)) * get(w, qd + j)
        most = _larger(most, change)
    still = get(w, p[7]) if step > 0 else 0.0 * least
    put(w, p[7], where(most < least, still + 1.0, 0.0))


@stage
def path(p, w, step):
    """Add the way of the origin of T to a length: (T, before, length)."""
    T, before = p[0], p[1]
    x, y, z = get(w, T + 3), get(w, T + 7), get(w, T + 11)
    if step > 0:
        dx, dy, dz = x - get(w, before), y - get(w, before + 1), z - get(w, before + 2)
        put(w, p[2], get(w, p[2]) + sqrt(dx * dx + dy * dy + dz * dz))
    put(w, before, x)
    put(w, before + 1, y)
    put(w, before + 2, z)


@part
def _bounds(w, norm, tolerance, hold, depth, N, watch):
    """Store the values with which later instants are compared.

    An error below many tolerances is no scale. A run that is held may start at its goal and lag
    behind it later: its error is not compared.
    """
    least = DIVERGENCE * tolerance
    scale = where(norm > least, norm, least)
    put(w, watch, DIVERGENCE * where(hold, np.inf, scale))
    put(w, watch + 1, DIVERGENCE * _most(w, depth, N, 0.0 * norm))


@stage
def judge(p, w, step):
    """Compute the outcome of each run.

    (q, nq, limits, status, depth, N, qd, n, size, norm, tolerance, hold, watch, still, steps,
    outcome). The limits are nq lowest and nq highest values; with `hold` a run that has converged
    or stalled goes on until the end of time.
    """
    q, nq, limits, N, n = p[0], p[1], p[2], p[5], p[7]
    size, norm, tolerance, hold = get(w, p[8]), get(w, p[9]), get(w, p[10]), get(w, p[11]) > 0.0
    zero = 0.0 * tolerance
    if step == 0:
        _bounds(w, norm, tolerance, hold, p[4], N, p[12])
    over, ends = step == p[14], ~hold
    if over:
        ends = hold | ~hold
    now = zero + (TIME_LIMIT if over else RUNNING)
    now = where((get(w, p[13]) >= STALL_PERIODS) & ends, 1.0 * LOCAL_MINIMUM, now)
    now = where(~(_most(w, p[6], n, zero) < np.inf), 1.0 * NOT_FINITE, now)
    away = (norm > get(w, p[12])) | (_most(w, p[4], N, zero) > get(w, p[12] + 1))
    now = where(away, 1.0 * DIVERGED, now)
    now = where((size < tolerance) & ends, 1.0 * CONVERGED, now)
    now = where(~(size < np.inf), 1.0 * NOT_FINITE, now)
    now = where(get(w, p[3]) == 1.0 * camera.OUT_OF_IMAGE, 1.0 * OUT_OF_IMAGE, now)
    now = where(get(w, p[3]) == 1.0 * camera.BEHIND_CAMERA, 1.0 * BEHIND_CAMERA, now)
    for i in range(nq):
        x = get(w, q + i)
        now = where(
            (x < get(w, limits + i)) | (x > get(w, limits + nq + i)), 1.0 * JOINT_LIMIT, now
        )
    now = where(~(_most(w, q, nq, zero) < np.inf), 1.0 * NOT_FINITE, now)
    put(w, p[15], now)


@stage
def stalls(p, w, step):
    """Turn a local minimum into a singularity where L J, scaled, has not the rank that it can have.

    (A, k, n, scale, rcond, full rank, outcome, scratch)
    """
    stalled = get(w, p[6]) == 1.0 * LOCAL_MINIMUM
    if some(stalled):
        A, k, n, scaled = p[0], p[1], p[2], p[7]
        y = scaled + k * n
        for i in range(k):
            put(w, y + i, 0.0)
            for j in range(n):
                put(w, scaled + n * i + j, get(w, A + n * i + j) * get(w, p[3] + i))
        rank = truncated(w, scaled, k, n, y, get(w, p[4]), y + k, -1, y + k + n)
        lost = stalled & (rank < get(w, p[5]))
        put(w, p[6], where(lost, 1.0 * SINGULAR, get(w, p[6])))


@stage
def wait(p, w, step):
    """Let runs go on that only pass their goal, and have moved since the image was taken.

    (A, k, n, qd, scale, pace, tolerance, size, age, near, outcome, steps, rates or -1), and the
    velocities that are commanded. The error must have been below the tolerance in every period
    since then; and what the joints do otherwise than commanded must not move a feature by the
    tolerance in the time 1/pace.
    """
    A, k, n, tolerance = p[0], p[1], p[2], get(w, p[6])
    near = get(w, p[7]) < tolerance
    if p[12] >= 0:
        least = tolerance * get(w, p[5])
        for i in range(k):
            change = 0.0 * tolerance
            for j in range(n):
                lag = get(w, p[12] + p[13 + j]) - get(w, p[3] + j)
                change = change + (get(w, A + n * i + j) * get(w, p[4] + i)) * lag
            near = near & (absolute(change) < least)
    before = get(w, p[9]) if step > 0 else 0.0 * tolerance
    count = where(near, before + 1.0, 0.0)
    put(w, p[9], count)
    passing = (get(w, p[10]) == 1.0 * CONVERGED) & (count <= get(w, p[8]))
    put(w, p[10], where(passing, 1.0 * (TIME_LIMIT if step == p[11] else RUNNING), get(w, p[10])))
