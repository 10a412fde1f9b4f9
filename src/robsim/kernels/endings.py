"""The rules for whether and why each run of a chunk ends, decided from one instant.

Where several reasons hold, the first of this order is given: a state that is not finite, a joint
limit, a mark behind the camera, a mark out of the image, convergence, divergence, a command that
is not finite, a stall (the caller distinguishes a singularity from a local minimum), the end of
time.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import camera
from robsim.kernels.extremes import largest
from robsim.kernels.jit import kernel, part

RUNNING, CONVERGED, LOCAL_MINIMUM, OUT_OF_IMAGE, BEHIND_CAMERA = 0, 1, 2, 3, 4
JOINT_LIMIT, SINGULAR, DIVERGED, NOT_FINITE, TIME_LIMIT = 5, 6, 7, 8, 9
STALL_PERIODS = 10
STALL = 0.01  # of the tolerance; a run on its way moves the features by about its error in 1/gain
DIVERGENCE = 100.0  # a run diverges when its error or depth exceeds that of its start so many times


class Watch(NamedTuple):
    """The memory of the ending rules for each run."""

    norm: Any  # an error beyond is divergence
    farthest: Any  # a depth beyond is divergence
    still: Any  # periods without motion
    before: Any  # (3, B) last position of the moving frame
    length: Any  # of its path so far


@kernel
def _norm(x, out):
    out[:] = 0.0
    for i in range(x.shape[0]):
        for b in range(out.size):
            out[b] += x[i, b] * x[i, b]
    for b in range(out.size):
        out[b] = math.sqrt(out[b])


@part
def _beyond(q, limits, out):
    """Compute out[b] = whether a coordinate is outside its limits."""
    out[:] = False
    for i in range(q.shape[0]):
        for b in range(out.size):
            out[b] |= (q[i, b] < limits[i, 0]) | (q[i, b] > limits[i, 1])


@part
def _worst(status, out):
    out[:] = camera.IN_IMAGE
    for n in range(status.shape[0]):
        for b in range(out.size):
            out[b] = max(out[b], status[n, b])


@part
def begin(error, depth, T, tolerance, hold, watch):
    """Store the values with which later instants are compared.

    An error below many tolerances is no scale. A run b with hold[b] may start at its goal and lag
    behind it later: its error is not compared.
    """
    _norm(error, watch.norm)
    largest(depth, watch.farthest)
    for b in range(watch.norm.size):
        scale = np.inf if hold[b] else max(watch.norm[b], DIVERGENCE * tolerance)
        watch.norm[b] = DIVERGENCE * scale
        watch.farthest[b] *= DIVERGENCE
        watch.still[b], watch.length[b] = 0, 0.0
        for r in range(3):
            watch.before[r, b] = T[r, 3, b]


@part
def _stands_still(task_jacobian, qd, pace, tolerance, still):
    """Count the periods in which the command hardly moves the features over 1/pace."""
    change, most = np.zeros((task_jacobian.shape[0], still.size)), np.empty(still.size)
    for i in range(task_jacobian.shape[0]):
        for j in range(task_jacobian.shape[1]):
            for b in range(still.size):
                change[i, b] += task_jacobian[i, j, b] * qd[j, b]
    largest(change, most)
    for b in range(still.size):
        still[b] = still[b] + 1 if most[b] < STALL * tolerance * pace else 0


@part
def _path(before, T, length):
    """Add the distance from before[3, b] to the origin of T[3, 4, b] to length; update before."""
    for b in range(length.size):
        x, y, z = T[0, 3, b] - before[0, b], T[1, 3, b] - before[1, b], T[2, 3, b] - before[2, b]
        length[b] += math.sqrt(x * x + y * y + z * z)
        before[0, b], before[1, b], before[2, b] = T[0, 3, b], T[1, 3, b], T[2, 3, b]


@part
def judge(
    q,
    limits,
    visibility,
    depth,
    T,
    error,
    qd,
    task_jacobian,
    pace,
    tolerance,
    over,
    hold,
    watch,
    outcome,
):
    """Compute outcome[b] after one instant; return how many runs have ended.

    `over` marks the last instant. With hold[b], a run that has converged or stalled goes on.

    The way to the origin of T is added to the length of the path. A run stands still while its
    command would move every feature by less than a hundredth of the tolerance in the time
    1/pace, and the error is not below the tolerance.
    """
    size, away, far = np.empty(outcome.size), np.empty(outcome.size), np.empty(outcome.size)
    state, speed = np.empty(outcome.size), np.empty(outcome.size)
    beyond, where = np.empty(outcome.size, np.bool_), np.empty(outcome.size, np.int8)
    largest(error, size)
    _norm(error, away)
    largest(depth, far)
    largest(q, state)
    largest(qd, speed)
    _beyond(q, limits, beyond)
    _worst(visibility, where)
    _stands_still(task_jacobian, qd, pace, tolerance, watch.still)
    _path(watch.before, T, watch.length)
    ended = 0
    for b in range(outcome.size):
        if not math.isfinite(state[b]):
            outcome[b] = NOT_FINITE
        elif beyond[b]:
            outcome[b] = JOINT_LIMIT
        elif where[b] == camera.BEHIND_CAMERA:
            outcome[b] = BEHIND_CAMERA
        elif where[b] == camera.OUT_OF_IMAGE:
            outcome[b] = OUT_OF_IMAGE
        elif not math.isfinite(size[b]):
            outcome[b] = NOT_FINITE
        elif size[b] < tolerance and (over or not hold[b]):
            outcome[b] = CONVERGED
        elif away[b] > watch.norm[b] or far[b] > watch.farthest[b]:
            outcome[b] = DIVERGED
        elif not math.isfinite(speed[b]):
            outcome[b] = NOT_FINITE
        elif watch.still[b] >= STALL_PERIODS and (over or not hold[b]):
            outcome[b] = LOCAL_MINIMUM
        elif over:
            outcome[b] = TIME_LIMIT
        else:
            outcome[b] = RUNNING
        if outcome[b] != RUNNING:
            ended += 1
    return ended
