"""Broyden's update of an estimated Jacobian. The run is the last axis."""

import numpy as np

from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.stages import stage

LEAST_STEP = 1e-9  # rad or m: a shorter step has no information beside the rounding of q and s


@entry("float64[:, :, ::1], float64[:, ::1], float64[:, ::1], out float64[:, :, ::1]")
def update_broyden(A, ds, dq, out):
    """Compute out = A + (ds - A dq) dq'/(dq' dq) of A[k, n, b], ds[k, b] and dq[n, b].

    If dq is zero, out = A. See Broyden 1965, "A class of methods for solving nonlinear
    simultaneous equations".
    """
    runs = dq.shape[1]
    square, rest = np.zeros(runs), np.empty(runs)
    for j in range(dq.shape[0]):
        for b in range(runs):
            square[b] += dq[j, b] * dq[j, b]
    for i in range(A.shape[0]):
        for b in range(runs):
            rest[b] = ds[i, b]
        for j in range(A.shape[1]):
            for b in range(runs):
                rest[b] -= A[i, j, b] * dq[j, b]
        for j in range(A.shape[1]):
            for b in range(runs):
                still = square[b] < LEAST_STEP * LEAST_STEP
                out[i, j, b] = A[i, j, b] + (0.0 if still else rest[b] * dq[j, b] / square[b])


@stage
def learn_jacobian(
    w,
    step,
    k="count",
    n="count",
    dt="row",
    s="k",
    predicted="k",
    qd="n",
    start="k, n",
    estimate="k, n",
    scratch="k*n + k + n",
):
    """Update the estimate A from the last step by Broyden's formula. At step 0, A = start.

    s are the features now, and `predicted` the features predicted for a robot at rest.
    """
    A = matrix(w, estimate, k, n)
    if step == 0:
        for i in range(k * n):
            put(w, estimate + i, get(w, start + i))
        return
    ds, dq, out = scratch + k * n, scratch + k * n + k, matrix(w, scratch, k, n)
    for i in range(k):
        put(w, ds + i, get(w, s + i) - get(w, predicted + i))
    for j in range(n):
        put(w, dq + j, get(w, qd + j) * get(w, dt))
    update_broyden(A, vector(w, ds, k), vector(w, dq, n), out)
    for i in range(k * n):
        put(w, estimate + i, get(w, scratch + i))
