"""Broyden's update of an estimated Jacobian, in the layout with the run last."""

import numpy as np

from robsim.kernels.jit import kernel

STILL = 1e-9  # rad or m: next to the rounding of q and s, a shorter step says nothing


@kernel
def update(A, ds, dq, out):
    """Compute out = A + (ds - A dq) dq'/(dq' dq) of A[k, n, b], ds[k, b] and dq[n, b].

    It is A where dq is zero. Broyden 1965, "A class of methods for solving nonlinear simultaneous
    equations".
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
                still = square[b] < STILL * STILL
                out[i, j, b] = A[i, j, b] + (0.0 if still else rest[b] * dq[j, b] / square[b])
