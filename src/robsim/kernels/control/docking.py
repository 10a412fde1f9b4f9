"""Stages of the docking of a unicycle."""

import math

import numpy as np

from robsim.kernels.formulas.lane_poses import compose
from robsim.kernels.formulas.se3 import exp, sinc
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.memory import matrix, vector
from robsim.kernels.machine.stage import stage

HERE = 1e-9  # metres; nearer, the bearing of the goal is rounding: the unicycle turns on the spot


@stage
def planar(p, w, step):
    """Compute x, y and heading in goal axes, from (c*t_c, theta u): (error, T_b_c, T_c_b, room, x).

    The room has 30 rows.
    """
    error, T, turned, twist = p[0], p[3], p[3] + 12, p[3] + 24
    for i in range(3):
        put(w, twist + i, 0.0)
        put(w, twist + 3 + i, get(w, error + 3 + i))
    exp(vector(w, twist, 6), matrix(w, T, 3, 4))
    for i in range(3):
        put(w, T + 4 * i + 3, get(w, error + i))
    compose(w, T, p[2], turned)
    compose(w, p[1], turned, T)
    put(w, p[4], get(w, T + 3))
    put(w, p[4] + 1, get(w, T + 7))
    for b in range(WIDTH):
        w[(p[4] + 2) * WIDTH + b] = math.atan2(w[(T + 4) * WIDTH + b], w[T * WIDTH + b])


@stage
def dock(p, w, step):
    """Compute v and omega (Aicardi et al. 1995): (x, gain, numbers, qd); numbers are turn and h."""
    for b in range(WIDTH):
        at = p[0] * WIDTH + b
        x, y, heading = w[at], w[at + WIDTH], w[at + 2 * WIDTH]
        gain, turn, h = w[p[1] * WIDTH + b], w[p[2] * WIDTH + b], w[(p[2] + 1) * WIDTH + b]
        rho = math.sqrt(x * x + y * y)
        theta = math.atan2(-y, -x) if rho > HERE else 0.0
        alpha = theta - heading
        alpha = alpha - 2.0 * math.pi * np.rint(alpha / (2.0 * math.pi))
        curl = math.cos(alpha) * sinc(alpha)
        w[p[3] * WIDTH + b] = gain * math.cos(alpha) * rho
        w[(p[3] + 1) * WIDTH + b] = turn * alpha + gain * curl * (alpha + h * theta)
