"""Control laws: joint velocities from the error, in the layout with the run last."""

import numpy as np

from robsim.kernels.jit import part
from robsim.kernels.solve import least_squares


@part
def joint(reach, error, gain, damping, rcond, qd):
    """Qd = -gain (L J)^+ e."""
    rank = np.empty(qd.shape[1], np.int64)
    least_squares(reach, error, damping, rcond, qd, rank)
    _scale(-gain, qd)


@part
def camera(L, J, error, length, gain, damping, rcond, qd):
    """V = -gain L^+ e, then qd = J^+ V, with |v| in units of `length`."""
    scaled_L, scaled_J, V = np.empty(L.shape), np.empty(J.shape), np.empty((6, qd.shape[1]))
    for c in range(6):
        unit = length if c < 3 else 1.0
        for i in range(L.shape[0]):
            for b in range(qd.shape[1]):
                scaled_L[i, c, b] = L[i, c, b] * unit
        for j in range(J.shape[1]):
            for b in range(qd.shape[1]):
                scaled_J[c, j, b] = J[c, j, b] / unit
    rank = np.empty(qd.shape[1], np.int64)
    least_squares(scaled_L, error, damping, rcond, V, rank)
    least_squares(scaled_J, V, damping, rcond, qd, rank)
    _scale(-gain, qd)


@part
def _scale(factor, x):
    for i in range(x.shape[0]):
        for b in range(x.shape[1]):
            x[i, b] *= factor
