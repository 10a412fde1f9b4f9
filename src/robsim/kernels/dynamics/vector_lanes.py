"""Vectors, rotations and symmetric matrices on lanes, for the dynamics of bodies.

A rotation has nine rows, row by row, and a symmetric matrix six rows: xx, xy, xz, yy, yz, zz.
"""

from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import get, put


@part
def get_vector(w, r):
    """Return three rows."""
    return get(w, r), get(w, r + 1), get(w, r + 2)


@part
def put_vector(w, r, x, y, z):
    """Write three rows."""
    put(w, r, x)
    put(w, r + 1, y)
    put(w, r + 2, z)


@part
def add_vector(w, r, x, y, z):
    """Add to three rows."""
    put(w, r, get(w, r) + x)
    put(w, r + 1, get(w, r + 1) + y)
    put(w, r + 2, get(w, r + 2) + z)


@part
def rotate(w, R, x, y, z):
    """Return R (x, y, z)."""
    return (
        get(w, R) * x + get(w, R + 1) * y + get(w, R + 2) * z,
        get(w, R + 3) * x + get(w, R + 4) * y + get(w, R + 5) * z,
        get(w, R + 6) * x + get(w, R + 7) * y + get(w, R + 8) * z,
    )


@part
def rotate_back(w, R, x, y, z):
    """Return R' (x, y, z)."""
    return (
        get(w, R) * x + get(w, R + 3) * y + get(w, R + 6) * z,
        get(w, R + 1) * x + get(w, R + 4) * y + get(w, R + 7) * z,
        get(w, R + 2) * x + get(w, R + 5) * y + get(w, R + 8) * z,
    )


@part
def times_symmetric(w, S, x, y, z):
    """Return S (x, y, z) for a symmetric matrix S."""
    return (
        get(w, S) * x + get(w, S + 1) * y + get(w, S + 2) * z,
        get(w, S + 1) * x + get(w, S + 3) * y + get(w, S + 4) * z,
        get(w, S + 2) * x + get(w, S + 4) * y + get(w, S + 5) * z,
    )


@part
def cross(a, b, c, x, y, z):
    """Return (a, b, c) x (x, y, z)."""
    return b * z - c * y, c * x - a * z, a * y - b * x
