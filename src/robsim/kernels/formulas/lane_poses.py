"""Poses on lanes. A pose has twelve rows, [R | t] row by row."""

from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import get, put


@part
def pose_row(w, T, r):
    """Return row r of a pose."""
    return get(w, T + 4 * r), get(w, T + 4 * r + 1), get(w, T + 4 * r + 2), get(w, T + 4 * r + 3)


@part
def pose_column(w, T, c):
    """Return axis c of a pose, or its origin for c = 3."""
    return get(w, T + c), get(w, T + 4 + c), get(w, T + 8 + c)


@part
def times_column(a, w, B, c):
    """Return a row of A times column c of B, without the translation of A."""
    return a[0] * get(w, B + c) + a[1] * get(w, B + 4 + c) + a[2] * get(w, B + 8 + c)


@kernel
def compose_lanes(w, A, B, T):
    """Compute T = A B. T and A may be the same rows."""
    for r in range(3):
        a = pose_row(w, A, r)
        for c in range(3):
            put(w, T + 4 * r + c, times_column(a, w, B, c))
        put(w, T + 4 * r + 3, times_column(a, w, B, 3) + a[3])


@part
def invert_lanes(w, A, T):
    """Compute T = A^-1 = [R' | -R' t]. T and A must be different rows."""
    x, y, z = pose_column(w, A, 3)
    for r in range(3):
        a, b, c = pose_column(w, A, r)
        put(w, T + 4 * r, a)
        put(w, T + 4 * r + 1, b)
        put(w, T + 4 * r + 2, c)
        put(w, T + 4 * r + 3, -(a * x + b * y + c * z))
