"""Interaction matrices L: sdot = L V_c, with V_c = (v, omega) the camera's twist in its axes."""

from robsim.kernels.camera import pinhole, pinhole_of
from robsim.kernels.jit import kernel, part
from robsim.kernels.lanes import get, put
from robsim.kernels.stage import stage

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


@stage
def points_stage(p, w, step):
    """Compute s and L of image points: (N, points, depth, s, L)."""
    for n in range(p[0]):
        x, y, inverse = get(w, p[1] + 2 * n), get(w, p[1] + 2 * n + 1), 1.0 / get(w, p[2] + n)
        put(w, p[3] + 2 * n, x)
        put(w, p[3] + 2 * n + 1, y)
        _put_row(w, p[4] + 12 * n, -inverse, 0.0 * x, x * inverse, x * y, -(1.0 + x * x), y)
        _put_row(w, p[4] + 12 * n + 6, 0.0 * x, -inverse, y * inverse, 1.0 + y * y, -x * y, -x)


@part
def _put_row(w, at, a, b, c, d, e, f):
    put(w, at, a)
    put(w, at + 1, b)
    put(w, at + 2, c)
    put(w, at + 3, d)
    put(w, at + 4, e)
    put(w, at + 5, f)


@stage
def pixels_stage(p, w, step):
    """Replace s and L of image points by those of their pixels: (N, camera, s, L)."""
    K, s, L = p[1], p[2], p[3]
    for n in range(p[0]):
        x, y, row = get(w, s + 2 * n), get(w, s + 2 * n + 1), L + 12 * n
        u, v = pinhole_of(
            x, y, get(w, K), get(w, K + 1), get(w, K + 2), get(w, K + 4), get(w, K + 5)
        )
        put(w, s + 2 * n, u)
        put(w, s + 2 * n + 1, v)
        for c in range(6):
            below = get(w, row + 6 + c)
            put(w, row + c, get(w, K) * get(w, row + c) + get(w, K + 1) * below)
            put(w, row + 6 + c, get(w, K + 4) * below)
