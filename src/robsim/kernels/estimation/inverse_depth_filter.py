"""Depth from known camera motion, by an extended Kalman filter for each mark. The run is last.

The state of a mark is (x, y, chi), its normalised image point and its inverse depth chi = 1/Z. The
image motion is nearly linear in chi (Matthies, Kanade and Szeliski 1989).
"""

import math

import numpy as np

from robsim.kernels.formulas import se3
from robsim.kernels.machine.array_views import matrix, tensor, vector
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage

NEAREST, FARTHEST = 0.01, 100.0  # metres: bounds of an estimate
# Process noise for inaccurate twists: standard deviations after one second of x and y, and of chi
# relative to its value.
POINT_DRIFT, DEPTH_DRIFT = 1e-4, 1e-2


@kernel
def _clip_inverse_depth(chi):
    """Return an inverse depth clipped to the bounds of an estimate."""
    return min(max(chi, 1.0 / FARTHEST), 1.0 / NEAREST)


@kernel
def move_mark(x, y, chi, T, b):
    """Return the state (x', y', chi') of a mark after X' = T[3, 4, b] X, and its Jacobian by rows.

    Y = R (x, y, 1) + chi p is X' divided by the old depth: x' = Y1/Y3, y' = Y2/Y3, chi' = chi/Y3.
    The depth of the mark is at least NEAREST.
    """
    Y1 = T[0, 0, b] * x + T[0, 1, b] * y + T[0, 2, b] + chi * T[0, 3, b]
    Y2 = T[1, 0, b] * x + T[1, 1, b] * y + T[1, 2, b] + chi * T[1, 3, b]
    Y3 = T[2, 0, b] * x + T[2, 1, b] * y + T[2, 2, b] + chi * T[2, 3, b]
    i = 1.0 / max(Y3, chi * NEAREST)
    u, v, w = Y1 * i, Y2 * i, chi * i
    a, c, d = T[2, 0, b], T[2, 1, b], T[2, 3, b]  # the derivative of Y3
    return (
        (u, v, w),
        ((T[0, 0, b] - u * a) * i, (T[0, 1, b] - u * c) * i, (T[0, 3, b] - u * d) * i),
        ((T[1, 0, b] - v * a) * i, (T[1, 1, b] - v * c) * i, (T[1, 3, b] - v * d) * i),
        (-w * a * i, -w * c * i, (1.0 - w * d) * i),
    )


@part
def _covariance_term(f, g, P, n, b):
    """Return F P g' for rows f, g of a Jacobian."""
    total = 0.0
    for r in range(3):
        total += f[r] * (P[n, r, 0, b] * g[0] + P[n, r, 1, b] * g[1] + P[n, r, 2, b] * g[2])
    return total


@kernel
def predict_depth(state, P, V, dt, state_out, P_out):
    """Predict state[n, 3, b] and covariance P[n, 3, 3, b] after a camera motion exp(V[6, b] dt).

    The state is exact. The covariance is propagated by the Jacobian, plus the process noise.
    """
    inverse_twist, T = np.empty(V.shape), np.empty((3, 4, V.shape[1]))
    for c in range(6):
        for b in range(V.shape[1]):
            inverse_twist[c, b] = -V[c, b] * dt
    se3.exp_se3(inverse_twist, T)
    for n in range(state.shape[0]):
        for b in range(state.shape[2]):
            new, f, g, h = move_mark(state[n, 0, b], state[n, 1, b], state[n, 2, b], T, b)
            chi = _clip_inverse_depth(new[2])
            state_out[n, 0, b], state_out[n, 1, b], state_out[n, 2, b] = new[0], new[1], chi
            drift, drift_chi = POINT_DRIFT**2 * dt, (DEPTH_DRIFT * chi) ** 2 * dt
            xy, xw, yw = (
                _covariance_term(f, g, P, n, b),
                _covariance_term(f, h, P, n, b),
                _covariance_term(g, h, P, n, b),
            )
            P_out[n, 0, 0, b] = _covariance_term(f, f, P, n, b) + drift
            P_out[n, 1, 1, b] = _covariance_term(g, g, P, n, b) + drift
            P_out[n, 2, 2, b] = _covariance_term(h, h, P, n, b) + drift_chi
            P_out[n, 0, 1, b], P_out[n, 1, 0, b] = xy, xy
            P_out[n, 0, 2, b], P_out[n, 2, 0, b] = xw, xw
            P_out[n, 1, 2, b], P_out[n, 2, 1, b] = yw, yw


@part
def _correct_coordinate(r, measured, variance, n, b, state, P):
    """Correct state and covariance of a mark by coordinate r of its measured point, in place."""
    a0, a1, a2 = P[n, 0, r, b], P[n, 1, r, b], P[n, 2, r, b]
    s = P[n, r, r, b] + variance
    k0, k1, k2, innovation = a0 / s, a1 / s, a2 / s, measured - state[n, r, b]
    state[n, 0, b] += k0 * innovation
    state[n, 1, b] += k1 * innovation
    state[n, 2, b] = _clip_inverse_depth(state[n, 2, b] + k2 * innovation)
    xy, xw, yw = P[n, 0, 1, b] - k0 * a1, P[n, 0, 2, b] - k0 * a2, P[n, 1, 2, b] - k1 * a2
    P[n, 0, 0, b] -= k0 * a0
    P[n, 1, 1, b] -= k1 * a1
    P[n, 2, 2, b] -= k2 * a2
    P[n, 0, 1, b], P[n, 1, 0, b] = xy, xy
    P[n, 0, 2, b], P[n, 2, 0, b] = xw, xw
    P[n, 1, 2, b], P[n, 2, 1, b] = yw, yw


@kernel
def correct_depth(state, P, x, sigma):
    """Correct state[n, 3, b] and P[n, 3, 3, b] in place by points x[n, 2, b].

    The errors of both coordinates are independent with standard deviations sigma[2, b], so the
    coordinates are processed one after the other. A point that is not finite was not measured, and
    its prediction stays unchanged.
    """
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            if math.isfinite(x[n, 0, b] + x[n, 1, b]):
                _correct_coordinate(0, x[n, 0, b], sigma[0, b] ** 2, n, b, state, P)
                _correct_coordinate(1, x[n, 1, b], sigma[1, b] ** 2, n, b, state, P)


@stage
def filter_depths(
    w,
    step,
    N="count",
    points="N, 2",
    dt="row",
    twist="6",
    numbers="4",
    estimate="N, 3",
    covariance="N, 3, 3",
    scratch="12*N",
    depth="N",
):
    """Filter the depths of N marks by the camera's twist and the measured points.

    The numbers are the initial 1/Z, its standard deviation, and the standard deviations of both
    coordinates of a point.
    """
    numbers, dt = vector(w, numbers, 4), w[dt * WIDTH]
    x, state = matrix(w, points, N, 2), matrix(w, estimate, N, 3)
    P, new = tensor(w, covariance, N, 3, 3), matrix(w, scratch, N, 3)
    if step == 0:
        initialise_depth_filter(x, numbers, state, P)
    else:
        predict_depth(state, P, vector(w, twist, 6), dt, new, tensor(w, scratch + 3 * N, N, 3, 3))
        for i in range(3 * N):
            put(w, estimate + i, get(w, scratch + i))
        for i in range(9 * N):
            put(w, covariance + i, get(w, scratch + 3 * N + i))
        correct_depth(state, P, x, numbers[2:])
    for n in range(N):
        put(w, depth + n, 1.0 / get(w, estimate + 3 * n + 2))


@kernel
def initialise_depth_filter(x, numbers, state, P):
    """Initialise state[n, 3, b] and P[n, 3, 3, b] from the first points x[n, 2, b].

    The numbers[4, b] are 1/Z, its standard deviation, and the standard deviations of both
    coordinates of a point.
    """
    P[:] = 0.0
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            state[n, 0, b], state[n, 1, b], state[n, 2, b] = x[n, 0, b], x[n, 1, b], numbers[0, b]
            P[n, 0, 0, b], P[n, 1, 1, b] = numbers[2, b] ** 2, numbers[3, b] ** 2
            P[n, 2, 2, b] = numbers[1, b] ** 2
