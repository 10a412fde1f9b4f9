"""Control laws: joint velocities from the error, in the layout with the run last."""

import numpy as np

from robsim.kernels.jit import part
from robsim.kernels.solve import invert, least_squares


@part
def joint(reach, error, gain, transposed, damping, rcond, qd):
    """Qd = -gain (L J)^+ e, or the transpose in place of the inverse."""
    invert(reach, error, transposed, damping, rcond, qd)
    _scale(-gain, qd)


@part
def camera(L, J, error, length, gain, transposed, damping, rcond, qd):
    """V = -gain L^+ e (or L' e), then qd = J^+ V, with |v| in units of `length`."""
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
    invert(scaled_L, error, transposed, damping, rcond, V)
    least_squares(scaled_J, V, damping, rcond, qd, rank)
    _scale(-gain, qd)


@part
def _scale(factor, x):
    for i in range(x.shape[0]):
        for b in range(x.shape[1]):
            x[i, b] *= factor
