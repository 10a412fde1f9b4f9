"""Interaction matrices L: sdot = L V_c, with V_c = (v, omega) the camera's twist in its axes."""

from robsim.kernels.camera import pinhole
from robsim.kernels.jit import kernel

CURRENT, DESIRED, MEAN = 0, 1, 2  # which interaction matrix
TRUE, GOAL, CONSTANT = 0, 1, 2  # which depth


@kernel
def points_interaction(x, Z, L):
    """Compute L[2n, 6, b] of points x[n, 2, b] at depths Z[n, b]: eq. (14) with f = 1."""
    for n in range(x.shape[0]):
        i, j = 2 * n, 2 * n + 1
        for b in range(x.shape[2]):
            u, v, iz = x[n, 0, b], x[n, 1, b], 1.0 / Z[n, b]
            L[i, 0, b], L[i, 1, b], L[i, 2, b] = -iz, 0.0, u * iz
            L[i, 3, b], L[i, 4, b], L[i, 5, b] = u * v, -(1.0 + u * u), v
            L[j, 0, b], L[j, 1, b], L[j, 2, b] = 0.0, -iz, v * iz
            L[j, 3, b], L[j, 4, b], L[j, 5, b] = 1.0 + v * v, -u * v, -u


@kernel
def to_pixels(x, K, s):
    """Compute s[2n, b] = pixels (column, row) of normalised points x[n, 2, b], undistorted."""
    for n in range(x.shape[0]):
        for b in range(x.shape[2]):
            s[2 * n, b], s[2 * n + 1, b] = pinhole(x[n, 0, b], x[n, 1, b], K)


@kernel
def to_pixel_rates(K, L):
    """Convert L of normalised points to L of pixels (column, row), in place."""
    for i in range(0, L.shape[0], 2):
        for c in range(6):
            for b in range(L.shape[2]):
                L[i, c, b] = K[0, 0] * L[i, c, b] + K[0, 1] * L[i + 1, c, b]
                L[i + 1, c, b] = K[1, 1] * L[i + 1, c, b]


@kernel
def flat(x, s):
    """Compute s[2n, b] = x1, y1, x2, y2, ... of points x[n, 2, b]."""
    for n in range(x.shape[0]):
        for r in range(2):
            for b in range(x.shape[2]):
                s[2 * n + r, b] = x[n, r, b]


@kernel
def difference(s, s_goal, error):
    """Compute error[k, b] = s - s_goal[k, 1]."""
    for i in range(s.shape[0]):
        for b in range(s.shape[1]):
            error[i, b] = s[i, b] - s_goal[i, 0]


@kernel
def choose_interaction(which, L_goal, L):
    """Replace L by itself, by L_goal[k, 6, 1], or by the mean of both."""
    if which != CURRENT:
        for i in range(L.shape[0]):
            for c in range(6):
                for b in range(L.shape[2]):
                    goal = L_goal[i, c, 0]
                    L[i, c, b] = goal if which == DESIRED else 0.5 * (L[i, c, b] + goal)


@kernel
def choose_depth(which, metres, scale, Z_goal, Z, out):
    """Compute out[n, b] = scale[n, 1] times the depth Z, that at the goal, or a constant."""
    for n in range(Z.shape[0]):
        for b in range(Z.shape[1]):
            if which == TRUE:
                out[n, b] = scale[n, 0] * Z[n, b]
            elif which == GOAL:
                out[n, b] = scale[n, 0] * Z_goal[n, 0]
            else:
                out[n, b] = scale[n, 0] * metres
