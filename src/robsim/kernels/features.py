"""Interaction matrices L: sdot = L V_c, with V_c = (v, omega) the camera's twist in its axes."""

from robsim.kernels.camera import pinhole_of
from robsim.kernels.jit import part
from robsim.kernels.lanes import get, put
from robsim.kernels.stage import stage


@part
def point_rates(x, y, inverse):
    """Return both rows of L of a normalised point at the depth 1/inverse: eq. (14) with f = 1."""
    first = -inverse, 0.0, x * inverse, x * y, -(1.0 + x * x), y
    return first, (0.0, -inverse, y * inverse, 1.0 + y * y, -x * y, -x)


@part
def points_interaction(x, Z, L):
    """Compute L[2n, 6, b] of points x[n, 2, b] at depths Z[n, b]."""
    for n in range(x.shape[0]):
        i, j = 2 * n, 2 * n + 1
        for b in range(x.shape[2]):
            rows = point_rates(x[n, 0, b], x[n, 1, b], 1.0 / Z[n, b])
            L[i, 0, b], L[i, 1, b], L[i, 2, b], L[i, 3, b], L[i, 4, b], L[i, 5, b] = rows[0]
            L[j, 0, b], L[j, 1, b], L[j, 2, b], L[j, 3, b], L[j, 4, b], L[j, 5, b] = rows[1]


@stage
def points_stage(p, w, step):
    """Compute s and L of image points: (N, points, depth, s, L)."""
    for n in range(p[0]):
        x, y, inverse = get(w, p[1] + 2 * n), get(w, p[1] + 2 * n + 1), 1.0 / get(w, p[2] + n)
        put(w, p[3] + 2 * n, x)
        put(w, p[3] + 2 * n + 1, y)
        put_point_rates(w, p[4] + 12 * n, x, y, inverse)


@part
def put_point_rates(w, at, x, y, inverse):
    """Write both rows of L of a normalised point at the depth 1/inverse."""
    first, second = point_rates(x, y, inverse)
    _put_row(w, at, first)
    _put_row(w, at + 6, second)


@part
def _put_row(w, at, row):
    put(w, at, row[0])
    put(w, at + 1, row[1])
    put(w, at + 2, row[2])
    put(w, at + 3, row[3])
    put(w, at + 4, row[4])
    put(w, at + 5, row[5])


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
