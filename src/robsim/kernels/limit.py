"""The limits of speeds by scaling of commands, in the layout with the run last."""

import math

import numpy as np

from robsim.kernels.jit import kernel, part


@part
def _speeds(J, qd, speed):
    """Compute speed[0, b] = |v| and speed[1, b] = |omega| of the twist J[6, n, b] qd[n, b]."""
    V = np.zeros((6, qd.shape[1]))
    for c in range(6):
        for j in range(qd.shape[0]):
            for b in range(qd.shape[1]):
                V[c, b] += J[c, j, b] * qd[j, b]
    for h in range(2):
        for b in range(qd.shape[1]):
            x, y, z = V[3 * h, b], V[3 * h + 1, b], V[3 * h + 2, b]
            speed[h, b] = math.sqrt(x * x + y * y + z * z)


@kernel
def scale(qd, J, joint, twist, out):
    """Compute out[n, b] = qd over the largest of 1 and each speed over its limit.

    The limits are joint[n] on |qd| and twist[2] on |v| and |omega| of the twist J[6, n, b] qd.
    """
    speed, excess = np.empty((2, qd.shape[1])), np.ones(qd.shape[1])
    _speeds(J, qd, speed)
    for h in range(2):
        for b in range(qd.shape[1]):
            excess[b] = max(excess[b], speed[h, b] / twist[h])
    for j in range(qd.shape[0]):
        for b in range(qd.shape[1]):
            excess[b] = max(excess[b], abs(qd[j, b]) / joint[j])
    for j in range(qd.shape[0]):
        for b in range(qd.shape[1]):
            out[j, b] = qd[j, b] / excess[b]
