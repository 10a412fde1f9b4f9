"""Stages of the control law that docks a unicycle."""

import math

import numpy as np

from robsim.kernels.formulas.lane_poses import compose_lanes
from robsim.kernels.formulas.se3 import exp_se3, sinc
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage

# metres; at a smaller distance the bearing of the goal is rounding error: turn on the spot
LEAST_DISTANCE = 1e-9


@stage
def compute_planar_pose(w, step, error="6", T_b_c="3, 4", T_c_b="3, 4", scratch="30", x="3"):
    """Compute the base's x, y and heading in goal axes from the camera's error (c*t_c, theta u)."""
    T, base_error, twist = scratch, scratch + 12, scratch + 24
    for i in range(3):
        put(w, twist + i, 0.0)
        put(w, twist + 3 + i, get(w, error + 3 + i))
    exp_se3(vector(w, twist, 6), matrix(w, T, 3, 4))
    for i in range(3):
        put(w, T + 4 * i + 3, get(w, error + i))
    compose_lanes(w, T, T_c_b, base_error)
    compose_lanes(w, T_b_c, base_error, T)
    put(w, x, get(w, T + 3))
    put(w, x + 1, get(w, T + 7))
    for b in range(WIDTH):
        w[(x + 2) * WIDTH + b] = math.atan2(w[(T + 4) * WIDTH + b], w[T * WIDTH + b])


@stage
def dock_unicycle(w, step, pose="3", rate="row", numbers="2", qd="2"):
    """Compute v and omega of the unicycle (Aicardi et al. 1995).

    `pose` is x, y and heading in goal axes, `rate` the gain, and the numbers are the gain of the
    turn and the weight h.
    """
    for b in range(WIDTH):
        at = pose * WIDTH + b
        x, y, heading = w[at], w[at + WIDTH], w[at + 2 * WIDTH]
        gain, turn, h = w[rate * WIDTH + b], w[numbers * WIDTH + b], w[(numbers + 1) * WIDTH + b]
        rho = math.sqrt(x * x + y * y)
        theta = math.atan2(-y, -x) if rho > LEAST_DISTANCE else 0.0
        alpha = theta - heading
        alpha = alpha - 2.0 * math.pi * np.rint(alpha / (2.0 * math.pi))
        curl = math.cos(alpha) * sinc(alpha)
        w[qd * WIDTH + b] = gain * math.cos(alpha) * rho
        w[(qd + 1) * WIDTH + b] = turn * alpha + gain * curl * (alpha + h * theta)
