"""Control laws that give joint velocities from the error, in the layout with the run last."""

import numpy as np

from robsim.kernels.jit import part
from robsim.kernels.solve import invert, least_squares, least_squares_of_product


@part
def joint(task_jacobian, error, gain, transposed, damping, rcond, qd):
    """Compute qd = -gain (L J)^+ e, or with the transpose in place of the inverse."""
    invert(task_jacobian, error, transposed, damping, rcond, qd)
    _scale(-gain, qd)


@part
def joint_of_product(L, J, task_jacobian, error, gain, transposed, damping, rcond, qd):
    """Compute the same for task_jacobian = L J, with L[k, 6, b]: fast where its rank is not full.

    With more than six features and joints it cannot be.
    """
    if transposed or damping > 0.0 or min(L.shape[0], J.shape[1]) <= 6:
        invert(task_jacobian, error, transposed, damping, rcond, qd)
    else:
        rank = np.empty(qd.shape[1], np.int64)
        least_squares_of_product(L, J, task_jacobian, error, rcond, qd, rank)
    _scale(-gain, qd)


@part
def camera(L, J, error, length, gain, transposed, damping, rcond, qd):
    """Compute V = -gain L^+ e (or L' e) and qd = J^+ V, with |v| in units of `length`."""
    scaled, V = np.empty(L.shape), np.empty((6, qd.shape[1]))
    for i in range(L.shape[0]):
        for c in range(6):
            for b in range(qd.shape[1]):
                scaled[i, c, b] = L[i, c, b] * length if c < 3 else L[i, c, b]
    invert(scaled, error, transposed, damping, rcond, V)
    for c in range(3):
        for b in range(qd.shape[1]):
            V[c, b] *= length
    realise(J, V, length, damping, rcond, qd)
    _scale(-gain, qd)


@part
def realise(J, V, length, damping, rcond, qd):
    """Compute qd = J^+ V for a twist V[6, b], with its |v| in units of `length` (eq. 19)."""
    scaled, wanted = np.empty(J.shape), np.empty(V.shape)
    for c in range(6):
        unit = length if c < 3 else 1.0
        for b in range(qd.shape[1]):
            wanted[c, b] = V[c, b] / unit
        for j in range(J.shape[1]):
            for b in range(qd.shape[1]):
                scaled[c, j, b] = J[c, j, b] / unit
    rank = np.empty(qd.shape[1], np.int64)
    least_squares(scaled, wanted, damping, rcond, qd, rank)


@part
def _scale(factor, x):
    for i in range(x.shape[0]):
        for b in range(x.shape[1]):
            x[i, b] *= factor
