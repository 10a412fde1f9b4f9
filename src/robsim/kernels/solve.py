"""Least squares x = A^+ y for many small systems at once, truncated or damped.

The usual way is a QR factorisation by modified Gram-Schmidt, which keeps the run innermost. It
yields R^-1 explicitly, and ||R|| ||R^-1|| (Frobenius) bounds the condition number from above: only
a run whose bound exceeds 1/rcond goes through its singular values, where those below
rcond * largest count as zero. Wide systems (more unknowns than equations) get the solution of
least norm, through the QR of A'.
"""

import numpy as np

from robsim.kernels.block import gather_rows, scatter_rows
from robsim.kernels.jit import kernel, part
from robsim.kernels.lanes import WIDTH, get, put, some, sqrt, where
from robsim.kernels.linked import linked
from robsim.kernels.singular import scratch_rows as truncated_rows
from robsim.kernels.singular import truncated
from robsim.kernels.stage import stage


@kernel
def product(A, B, out):
    """Compute out[i, j, b] = A[i, k, b] B[k, j, b]."""
    out[:] = 0.0
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for k in range(A.shape[1]):
                for b in range(A.shape[2]):
                    out[i, j, b] += A[i, k, b] * B[k, j, b]


@part
def _orthonormalise(block, Q, rows, n, R):
    """Replace the columns of Q by orthonormal ones, with R upper triangular and Q_before = Q R.

    Both stand column by column: Q of so many `rows`, R of n. Two columns are taken at a time, whose
    sums do not wait for one another.
    """
    for j in range(n):
        q = Q + j * rows
        square = get(block, q) * get(block, q)
        for i in range(1, rows):
            square = square + get(block, q + i) * get(block, q + i)
        length = sqrt(square)
        put(block, R + j * n + j, length)
        share = 1.0 / length
        for i in range(rows):
            put(block, q + i, get(block, q + i) * share)
        k = j + 1
        while k + 1 < n:
            _parts_along(block, q, Q + k * rows, rows, R + k * n + j, n)
            k += 2
        if k < n:
            put(block, R + k * n + j, _part_along(block, q, Q + k * rows, rows))


@part
def _parts_along(block, q, v, rows, r, n):
    """Subtract from two vectors that follow one another their parts along the unit vector q."""
    u = v + rows
    one, two = get(block, q) * get(block, v), get(block, q) * get(block, u)
    for i in range(1, rows):
        x = get(block, q + i)
        one, two = one + x * get(block, v + i), two + x * get(block, u + i)
    for i in range(rows):
        x = get(block, q + i)
        put(block, v + i, get(block, v + i) - x * one)
        put(block, u + i, get(block, u + i) - x * two)
    put(block, r, one)
    put(block, r + n, two)


@part
def _part_along(block, q, v, rows):
    """Subtract from a vector its part along the unit vector q, and return how long that was."""
    along = get(block, q) * get(block, v)
    for i in range(1, rows):
        along = along + get(block, q + i) * get(block, v + i)
    for i in range(rows):
        put(block, v + i, get(block, v + i) - get(block, q + i) * along)
    return along


@part
def invert_triangle(block, R, n, inverse):
    """Compute inverse = R^-1 for upper triangular R, column by column."""
    for j in range(n):
        put(block, inverse + j * n + j, 1.0 / get(block, R + j * n + j))
        for i in range(j - 1, -1, -1):
            total = get(block, R + (i + 1) * n + i) * get(block, inverse + j * n + i + 1)
            for k in range(i + 2, j + 1):
                total = total + get(block, R + k * n + i) * get(block, inverse + j * n + k)
            put(block, inverse + j * n + i, -total * get(block, inverse + i * n + i))


@part
def _condition_bound(block, R, inverse, n, bound):
    """Compute bound = ||R||_F ||R^-1||_F >= the condition number."""
    direct, back = get(block, R) * get(block, R), get(block, inverse) * get(block, inverse)
    for j in range(1, n):
        for i in range(j + 1):
            r, s = get(block, R + j * n + i), get(block, inverse + j * n + i)
            direct, back = direct + r * r, back + s * s
    put(block, bound, sqrt(direct) * sqrt(back))


@part
def _solve_tall(block, Q, rows, n, inverse, y, x):
    """Compute x = R^-1 Q' y, with y projected step by step, which keeps Gram-Schmidt stable.

    y is spoilt, and x has room for 2 n rows.
    """
    for j in range(n):
        put(block, x + n + j, _part_along(block, Q + j * rows, y, rows))
    for i in range(n):
        total = get(block, inverse + i * n + i) * get(block, x + n + i)
        for j in range(i + 1, n):
            total = total + get(block, inverse + j * n + i) * get(block, x + n + j)
        put(block, x + i, total)


@part
def _solve_wide(block, Q, rows, n, inverse, y, x, count):
    """Compute the first `count` rows of x = Q R^-T y; y[n] is replaced by R^-T y."""
    for j in range(n - 1, -1, -1):
        total = get(block, inverse + j * n) * get(block, y)
        for i in range(1, j + 1):
            total = total + get(block, inverse + j * n + i) * get(block, y + i)
        put(block, y + j, total)
    for i in range(count):
        total = get(block, Q + i) * get(block, y)
        for j in range(1, n):
            total = total + get(block, Q + j * rows + i) * get(block, y + j)
        put(block, x + i, total)


def scratch_of(k: int, n: int) -> int:
    """Return how many rows `solve_block` needs to work in."""
    m, p = min(k, n), max(k, n)
    return (p + m) * m + 2 * m * m + (p + m) + (p + m) + 1 + n


scratch_rows = part(scratch_of)


@stage
def by_triangle(numbers, block, step):
    """Compute x = A^+ y by a QR factorisation: (A, k, n, y, damping or -1, x, scratch).

    The first row of `scratch` becomes a bound of the condition number of A.
    """
    A, k, n, y, damping, x = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]
    wide, m, p = k < n, min(k, n), max(k, n)
    rows = p + m if damping >= 0 else p
    bound = numbers[6]
    Q, R = bound + 1, bound + 1 + rows * m
    inverse = R + m * m
    wanted, found = inverse + m * m, inverse + m * m + rows
    for j in range(m):
        for i in range(p):
            put(block, Q + j * rows + i, get(block, A + (j * n + i if wide else i * n + j)))
        for i in range(p, rows):
            put(block, Q + j * rows + i, 0.0)
        if damping >= 0:
            put(block, Q + j * rows + p + j, get(block, damping))
    for i in range(rows):
        put(block, wanted + i, 0.0)
    for i in range(k):
        put(block, wanted + i, get(block, y + i))
    _orthonormalise(block, Q, rows, m, R)
    invert_triangle(block, R, m, inverse)
    _condition_bound(block, R, inverse, m, bound)
    if wide:
        _solve_wide(block, Q, rows, m, inverse, wanted, found, p)
    else:
        _solve_tall(block, Q, rows, m, inverse, wanted, found)
    for i in range(n):
        put(block, x + i, get(block, found + i))


_triangle = linked(by_triangle)


@part
def _by_triangle(block, A, k, n, y, damping, x, scratch):
    """Compute x = A^+ y by a QR factorisation; return a bound of the condition number of A.

    `damping` is a row, or -1 where there is none.
    """
    _triangle(block, (A, k, n, y, damping, x, scratch))
    return get(block, scratch)


@part
def _truncate(block, A, k, n, y, rcond, doubtful, x, full, scratch):
    """Replace x of the doubtful runs by that of their singular values; return the rank.

    A run whose A is not finite is NaN.
    """
    other = scratch + truncated_rows(k, n)
    rank = truncated(block, A, k, n, y, rcond, other, scratch)
    total = 0.0 * get(block, A)
    for i in range(1, k * n):
        total = total + 0.0 * get(block, A + i)
    for i in range(n):
        put(block, x + i, where(doubtful, get(block, other + i) + total, get(block, x + i)))
    return where(doubtful & (total == 0.0), rank, full)


@part
def solve_block(block, A, k, n, y, damping, rcond, x, scratch):
    """Compute x = argmin ||A x - y||^2 + damping^2 ||x||^2 for A[k, n], and return the rank of A.

    A stands row by row. Without damping (-1, else a row) singular values below
    rcond * largest are truncated. A damped rank is not examined and reads as full.
    """
    bound = _by_triangle(block, A, k, n, y, damping, x, scratch)
    doubtful = ~(bound * rcond < 1.0)
    rank = 0.0 * rcond + min(k, n)
    if damping < 0 and some(doubtful):
        rank = _truncate(block, A, k, n, y, rcond, doubtful, x, rank, scratch)
    return rank


def product_scratch_of(k: int, n: int) -> int:
    """Return how many rows `solve_product_block` needs to work in."""
    return max(scratch_of(k, n), max(scratch_of(k, 6), scratch_of(6, n)) + 6)


@part
def solve_product_block(block, B, k, C, n, A, y, rcond, x, scratch):
    """Compute x = A^+ y of A = B C, with B[k, 6] and C[6, n], 6 <= k, n.

    Where B and C have rank 6, (B C)^+ = C^+ B^+ (Greville 1966), though A itself has no full rank
    if 6 < k, n: so no singular values are needed. The product of both bounds is a bound for A.
    """
    z, rest = scratch, scratch + 6
    bound = _by_triangle(block, B, k, 6, y, -1, z, rest)
    bound = bound * _by_triangle(block, C, 6, n, z, -1, x, rest)
    doubtful, rank = ~(bound * rcond < 1.0), 0.0 * rcond + 6.0
    if some(doubtful):
        rank = _truncate(block, A, k, n, y, rcond, doubtful, x, rank, scratch)
    return rank


@kernel
def least_squares(A, y, damping, rcond, x, rank):
    """Compute x[n, b] = argmin ||A x - y||^2 + damping^2 ||x||^2, and rank[b] of A[m, n, b].

    With damping 0 singular values below rcond * largest are truncated. A damped rank is not
    examined and reads as full.
    """
    k, n, runs = A.shape
    wanted = k * n
    found = wanted + k
    given = found + n
    scratch = given + 3
    block = np.zeros((scratch + scratch_rows(k, n)) * WIDTH)
    put(block, given, damping)
    put(block, given + 1, rcond)
    for b in range(0, runs, WIDTH):
        _gather_matrix(A, b, 0, block)
        gather_rows(y, b, wanted, block)
        damped = given if damping > 0.0 else -1
        share = get(block, given + 1)
        put(block, given + 2, solve_block(block, 0, k, n, wanted, damped, share, found, scratch))
        scatter_rows(block, found, b, x)
        for lane in range(min(WIDTH, runs - b)):
            rank[b + lane] = int(block[(given + 2) * WIDTH + lane])


@kernel
def _gather_matrix(A, b, row, block):
    """Copy A[:, :, b...] to rows of a block, row by row."""
    for i in range(A.shape[0]):
        gather_rows(A[i], b, row + i * A.shape[1], block)
