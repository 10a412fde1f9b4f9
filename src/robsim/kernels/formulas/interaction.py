"""Interaction matrices L of image points: sdot = L V_c, V_c = (v, omega) in camera axes."""

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import put


@part
def point_rates(x, y, inverse):
    """Return both rows of L of a normalised point at the depth 1/inverse: eq. (14) with f = 1."""
    first = -inverse, 0.0, x * inverse, x * y, -(1.0 + x * x), y
    return first, (0.0, -inverse, y * inverse, 1.0 + y * y, -x * y, -x)


@entry("float64[:, :, ::1], float64[:, ::1], out float64[:, :, ::1]", inline="always")
def points_interaction(x, Z, L):
    """Compute L[2n, 6, b] of points x[n, 2, b] at depths Z[n, b]."""
    for n in range(x.shape[0]):
        i, j = 2 * n, 2 * n + 1
        for b in range(x.shape[2]):
            rows = point_rates(x[n, 0, b], x[n, 1, b], 1.0 / Z[n, b])
            L[i, 0, b], L[i, 1, b], L[i, 2, b], L[i, 3, b], L[i, 4, b], L[i, 5, b] = rows[0]
            L[j, 0, b], L[j, 1, b], L[j, 2, b], L[j, 3, b], L[j, 4, b], L[j, 5, b] = rows[1]


@part
def put_point_rates(w, at, x, y, inverse):
    """Write both rows of L of a normalised point at the depth 1/inverse."""
    first, second = point_rates(x, y, inverse)
    _put_interaction_row(w, at, first)
    _put_interaction_row(w, at + 6, second)


@part
def _put_interaction_row(w, at, row):
    put(w, at, row[0])
    put(w, at + 1, row[1])
    put(w, at + 2, row[2])
    put(w, at + 3, row[3])
    put(w, at + 4, row[4])
    put(w, at + 5, row[5])
