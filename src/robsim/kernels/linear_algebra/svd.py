"""Singular value decomposition of many small matrices by one-sided Jacobi rotations.

A run with orthogonal columns stays unchanged while other runs are still rotated, so its bits do not
depend on its neighbours.
"""

import numpy as np

from robsim.kernels.machine.block_io import gather_row, scatter_row, scatter_rows
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, absolute, any_lane, get, put, sqrt, where
from robsim.kernels.machine.linked_stages import link_stage
from robsim.kernels.machine.stages import stage

SWEEPS = 60  # most sweeps; six or seven are usual
FAR = 1e3  # metres: a unit of length above FAR or below 1/FAR is out of scale
ORTHOGONAL = 1e-15  # columns with a smaller cosine of their angle are orthogonal


@part
def _jacobi_rotation(block, p, q, rows):
    """Return cosine and sine of the rotation of two columns, and the mask of runs that need it."""
    a, c, d = get(block, p), get(block, p), get(block, q)
    a, c, d = a * a, c * d, d * d
    for i in range(1, rows):
        x, y = get(block, p + i), get(block, q + i)
        a, c, d = a + x * x, c + x * y, d + y * y
    needed = absolute(c) > ORTHOGONAL * sqrt(a * d)
    zeta = (d - a) / (2.0 * where(needed, c, 1.0))
    t = where(zeta < 0.0, -1.0, 1.0) / (absolute(zeta) + sqrt(1.0 + zeta * zeta))
    cosine = 1.0 / sqrt(1.0 + t * t)
    return cosine, cosine * t, needed


@part
def _rotate_columns(block, p, q, rows, cosine, sine, needed):
    """Rotate two columns in the runs of the mask `needed`."""
    for i in range(rows):
        x, y = get(block, p + i), get(block, q + i)
        put(block, p + i, where(needed, cosine * x - sine * y, x))
        put(block, q + i, where(needed, sine * x + cosine * y, y))


@part
def _orthogonalise_columns(block, G, rows, n, V):
    """Rotate the n columns of G until they are orthogonal. Apply the rotations to V (n, n), too."""
    for _ in range(SWEEPS):
        straight = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                c, s, needed = _jacobi_rotation(block, G + p * rows, G + q * rows, rows)
                if any_lane(needed):
                    straight = False
                    _rotate_columns(block, G + p * rows, G + q * rows, rows, c, s, needed)
                    _rotate_columns(block, V + p * n, V + q * n, n, c, s, needed)
        if straight:
            return


@part
def _column_lengths(block, G, rows, n, out):
    """Compute the length of each of n columns."""
    for j in range(n):
        at = G + j * rows
        square = get(block, at) * get(block, at)
        for i in range(1, rows):
            square = square + get(block, at + i) * get(block, at + i)
        put(block, out + j, sqrt(square))


@stage
def rotate(p, block, step):
    """Rotate the columns of G until they are orthogonal, with p = (G, rows, n, V, sigma).

    V accumulates the rotations, and sigma are the lengths of the columns.
    """
    G, rows, n, V, sigma = p[0], p[1], p[2], p[3], p[4]
    for j in range(n):
        for i in range(n):
            put(block, V + j * n + i, 1.0 if i == j else 0.0)
    _orthogonalise_columns(block, G, rows, n, V)
    _column_lengths(block, G, rows, n, sigma)


_linked_rotate = link_stage(rotate)


@part
def decompose_columns(block, G, rows, n, V, sigma):
    """Decompose A = G V' with orthogonal columns of G (rows, n) and an orthogonal V (n, n).

    The columns of A are replaced by G in place. sigma are the lengths of the columns of G.
    """
    _linked_rotate(block, (G, rows, n, V, sigma))


@part
def greatest_row(block, x, n):
    """Return the largest of n nonnegative numbers, ignoring NaN after the first number."""
    most = get(block, x)
    for j in range(1, n):
        most = where(get(block, x + j) > most, get(block, x + j), most)
    return most


def count_truncation_rows(k: int, n: int) -> int:
    """Return the number of scratch rows that `solve_truncated` needs."""
    p, q = max(k, n), min(k, n)
    return 1 + p * q + q * q + q


truncation_rows = part(count_truncation_rows)


@part
def is_per_metre(block, A, J, n, j):
    """Return the mask of runs with a column j of A (k, n) that is per metre of a pure translation.

    The motions are the columns of J (6, n). A negative J is -1 - c, and the first c columns of A
    are per metre.
    """
    zero = 0.0 * get(block, A)
    if J < 0:
        return zero == (0.0 if j < -1 - J else 1.0)
    turns = absolute(get(block, J + 3 * n + j)) + absolute(get(block, J + 4 * n + j))
    return turns + absolute(get(block, J + 5 * n + j)) == zero


@part
def choose_length_unit(block, A, k, n, J):
    """Return the unit of length that makes columns of A per metre as large as columns per radian.

    The unit is 1 if it is between 1/FAR and FAR metres. Within this range the user's scale is kept,
    and the user may choose `rcond`.
    """
    metres, radians = 0.0 * get(block, A), 0.0 * get(block, A)
    for j in range(n):
        square = get(block, A + j) * get(block, A + j)
        for i in range(1, k):
            square = square + get(block, A + i * n + j) * get(block, A + i * n + j)
        here = is_per_metre(block, A, J, n, j)
        metres, radians = metres + where(here, square, 0.0), radians + where(here, 0.0, square)
    length = sqrt(radians / metres)
    far = ((length > FAR) & (length < np.inf)) | ((length * FAR < 1.0) & (length > 0.0))
    return where(far, length, 1.0)


@stage
def truncate(p, block, step):
    """Compute x = A^+ y without small singular values, with p = (A, k, n, y, x, J, scratch).

    On entry the first row of `scratch` holds rcond: singular values below rcond times the largest
    singular value count as zero. On exit it holds the rank. Columns of A per metre (see
    `is_per_metre`) are scaled to a unit of length that makes them as large as the other columns.
    Then x = D (A D)^+ y with D = diag(length or 1), and the result does not depend on the size of
    the world and the robot.
    """
    A, k, n, y, x, J, scratch = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    length = choose_length_unit(block, A, k, n, J)
    wide, q, tall = k < n, min(k, n), max(k, n)
    rcond, G = get(block, scratch), scratch + 1
    V, sigma = G + tall * q, G + tall * q + q * q
    for j in range(q):
        for i in range(tall):
            size = where(is_per_metre(block, A, J, n, i if wide else j), length, 1.0)
            put(block, G + j * tall + i, get(block, A + (j * n + i if wide else i * n + j)) * size)
    decompose_columns(block, G, tall, q, V, sigma)
    least = rcond * greatest_row(block, sigma, q)
    left, height, right, width = (V, q, G, tall) if wide else (G, tall, V, q)
    rank = 0.0 * least
    for i in range(n):
        put(block, x + i, rank)
    for j in range(q):
        along = get(block, left + j * height) * get(block, y)
        for i in range(1, k):
            along = along + get(block, left + j * height + i) * get(block, y + i)
        size = get(block, sigma + j)
        counts = size > least
        rank = rank + where(counts, 1.0, 0.0)
        along = where(counts, along / (size * size), 0.0)
        for i in range(n):
            put(block, x + i, get(block, x + i) + get(block, right + j * width + i) * along)
    for i in range(n):
        put(block, x + i, get(block, x + i) * where(is_per_metre(block, A, J, n, i), length, 1.0))
    put(block, scratch, rank)


_linked_truncate = link_stage(truncate)


@part
def solve_truncated(block, A, k, n, y, rcond, x, J, scratch):
    """Compute x = A^+ y without singular values below rcond * largest, and return the rank.

    `count_truncation_rows` returns the number of scratch rows. J determines the columns per metre,
    see `is_per_metre`. With J = -1 no unit of length is computed.
    """
    put(block, scratch, rcond)
    _linked_truncate(block, (A, k, n, y, x, J, scratch))
    return get(block, scratch)


@kernel
def decompose_matrices(A, G, V, sigma):
    """Decompose A[m, n, b], or its transpose if A is wide, into G V'.

    The columns of G have the lengths sigma[k, b] with k = min(m, n). V[k, k, b] is orthogonal.
    """
    wide, (rows, n, runs) = A.shape[0] < A.shape[1], G.shape
    block = np.empty((rows + n + 1) * n * WIDTH)
    first_V, first_sigma = rows * n, (rows + n) * n
    for b in range(0, runs, WIDTH):
        for j in range(n):
            for i in range(rows):
                gather_row(A[j, i] if wide else A[i, j], b, j * rows + i, block)
        decompose_columns(block, 0, rows, n, first_V, first_sigma)
        scatter_rows(block, first_sigma, b, sigma)
        for j in range(n):
            for i in range(n):
                scatter_row(block, first_V + j * n + i, b, V[i, j])
            for i in range(rows):
                scatter_row(block, j * rows + i, b, G[i, j])
