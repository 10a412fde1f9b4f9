"""Vectors, rotations and symmetric matrices on lanes, in consecutive rows of a block.

A vector has three rows, a rotation nine (row by row), and a symmetric matrix the six rows xx, xy,
xz, yy, yz, zz.
"""

from robsim.kernels.machine.intrinsics import fragment
from robsim.kernels.machine.lanes import get, put


@fragment
def get_vector(w, row):
    """Return a vector."""
    return get(w, row), get(w, row + 1), get(w, row + 2)


@fragment
def put_vector(w, row, x, y, z):
    """Write a vector."""
    put(w, row, x)
    put(w, row + 1, y)
    put(w, row + 2, z)


@fragment
def add_to_vector(w, row, x, y, z):
    """Add to a vector in rows of a block."""
    put(w, row, get(w, row) + x)
    put(w, row + 1, get(w, row + 1) + y)
    put(w, row + 2, get(w, row + 2) + z)


@fragment
def cross_product(a, b, c, x, y, z):
    """Return the cross product of two vectors."""
    return b * z - c * y, c * x - a * z, a * y - b * x


@fragment
def times_matrix(w, M, x, y, z):
    """Return the product of a 3 x 3 matrix and a vector."""
    return (
        get(w, M) * x + get(w, M + 1) * y + get(w, M + 2) * z,
        get(w, M + 3) * x + get(w, M + 4) * y + get(w, M + 5) * z,
        get(w, M + 6) * x + get(w, M + 7) * y + get(w, M + 8) * z,
    )


@fragment
def times_transpose(w, M, x, y, z):
    """Return the product of the transpose of a 3 x 3 matrix and a vector."""
    return (
        get(w, M) * x + get(w, M + 3) * y + get(w, M + 6) * z,
        get(w, M + 1) * x + get(w, M + 4) * y + get(w, M + 7) * z,
        get(w, M + 2) * x + get(w, M + 5) * y + get(w, M + 8) * z,
    )


@fragment
def times_symmetric(w, M, x, y, z):
    """Return the product of a symmetric matrix and a vector."""
    return (
        get(w, M) * x + get(w, M + 1) * y + get(w, M + 2) * z,
        get(w, M + 1) * x + get(w, M + 3) * y + get(w, M + 4) * z,
        get(w, M + 2) * x + get(w, M + 4) * y + get(w, M + 5) * z,
    )


@fragment
def rotate_symmetric(w, R, M):
    """Return R M R' of a symmetric matrix M, as the numbers xx, xy, xz, yy, yz, zz."""
    ax, ay, az = times_symmetric(w, M, get(w, R), get(w, R + 1), get(w, R + 2))
    bx, by, bz = times_symmetric(w, M, get(w, R + 3), get(w, R + 4), get(w, R + 5))
    cx, cy, cz = times_symmetric(w, M, get(w, R + 6), get(w, R + 7), get(w, R + 8))
    xx, xy, xz = times_matrix(w, R, ax, ay, az)
    _, yy, yz = times_matrix(w, R, bx, by, bz)
    _, _, zz = times_matrix(w, R, cx, cy, cz)
    return xx, xy, xz, yy, yz, zz
