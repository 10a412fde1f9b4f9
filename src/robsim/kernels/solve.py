"""Least squares x = A^+ y for many small systems at once, truncated or damped.

The usual way is a QR factorisation by modified Gram-Schmidt, which keeps the run innermost. It
yields R^-1 explicitly, and ||R|| ||R^-1|| (Frobenius) bounds the condition number from above: only
a run whose bound exceeds 1/rcond goes through its singular values, where those below
rcond * largest count as zero. Wide systems (more unknowns than equations) get the solution of
least norm, through the QR of A'.
"""

import math

import numpy as np

from robsim.kernels.block import gather_row, gather_rows, scatter_rows
from robsim.kernels.jit import kernel, part
from robsim.kernels.lanes import WIDTH, get, put, sqrt
from robsim.kernels.singular import solve_truncated


@kernel
def product(A, B, out):
    """Compute out[i, j, b] = A[i, k, b] B[k, j, b]."""
    out[:] = 0.0
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for k in range(A.shape[1]):
                for b in range(A.shape[2]):
                    out[i, j, b] += A[i, k, b] * B[k, j, b]


@kernel
def _gather(A, wide, damping, b, rows, block):
    """Copy A[:, :, b...] or A', whichever is tall, over damping * identity, column by column."""
    n, p = min(A.shape[0], A.shape[1]), max(A.shape[0], A.shape[1])
    for j in range(n):
        for i in range(p):
            gather_row(A[j, i] if wide else A[i, j], b, j * rows + i, block)
        for i in range(p, rows):
            put(block, j * rows + i, damping if i - p == j else 0.0)


@kernel
def _orthonormalise(block, Q, rows, n, R):
    """Replace the columns of Q by orthonormal ones, with R upper triangular and Q_before = Q R.

    Both stand column by column: Q of so many `rows`, R of n.
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
        for k in range(j + 1, n):
            put(block, R + k * n + j, _part_along(block, q, Q + k * rows, rows))


@part
def _part_along(block, q, v, rows):
    """Subtract from a vector its part along the unit vector q, and return how long that was."""
    along = get(block, q) * get(block, v)
    for i in range(1, rows):
        along = along + get(block, q + i) * get(block, v + i)
    for i in range(rows):
        put(block, v + i, get(block, v + i) - get(block, q + i) * along)
    return along


@kernel
def _invert_triangle(block, R, n, inverse):
    """Compute inverse = R^-1 for upper triangular R, column by column."""
    for j in range(n):
        put(block, inverse + j * n + j, 1.0 / get(block, R + j * n + j))
        for i in range(j - 1, -1, -1):
            total = get(block, R + (i + 1) * n + i) * get(block, inverse + j * n + i + 1)
            for k in range(i + 2, j + 1):
                total = total + get(block, R + k * n + i) * get(block, inverse + j * n + k)
            put(block, inverse + j * n + i, -total * get(block, inverse + i * n + i))


@kernel
def _condition_bound(block, R, inverse, n, bound):
    """Compute bound = ||R||_F ||R^-1||_F >= the condition number."""
    direct, back = get(block, R) * get(block, R), get(block, inverse) * get(block, inverse)
    for j in range(1, n):
        for i in range(j + 1):
            r, s = get(block, R + j * n + i), get(block, inverse + j * n + i)
            direct, back = direct + r * r, back + s * s
    put(block, bound, sqrt(direct) * sqrt(back))


@kernel
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


@kernel
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


@kernel
def _is_finite(A, b):
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            if not math.isfinite(A[i, j, b]):
                return False
    return True


@kernel
def _by_triangle(A, y, damping, x, bound):
    """Compute x = A^+ y by a QR factorisation, and bound[0, b] >= the condition number of A."""
    wide, runs = A.shape[0] < A.shape[1], A.shape[2]
    n, p = min(A.shape[0], A.shape[1]), max(A.shape[0], A.shape[1])
    rows = p + n if damping > 0.0 else p
    Q, R, inverse, wanted, found = 0, rows * n, (rows + n) * n, (rows + 2 * n) * n, 0
    found = wanted + rows
    block = np.zeros((found + p + n + 1) * WIDTH)
    for b in range(0, runs, WIDTH):
        _gather(A, wide, damping, b, rows, block)
        gather_rows(y, b, wanted, block)
        for i in range(y.shape[0], rows):
            put(block, wanted + i, 0.0)
        _orthonormalise(block, Q, rows, n, R)
        _invert_triangle(block, R, n, inverse)
        _condition_bound(block, R, inverse, n, found + p + n)
        if wide:
            _solve_wide(block, Q, rows, n, inverse, wanted, found, p)
        else:
            _solve_tall(block, Q, rows, n, inverse, wanted, found)
        scatter_rows(block, found, b, x)
        scatter_rows(block, found + p + n, b, bound)


@kernel
def _truncate(A, y, rcond, bound, x, rank):
    """Solve the runs again by singular values whose condition number may exceed 1/rcond.

    A run whose A is not finite is NaN, and keeps its rank.
    """
    some, count = np.empty(bound.size, np.int64), 0
    for b in range(bound.size):
        if not bound[b] * rcond < 1.0:
            if _is_finite(A, b):
                some[count] = b
                count += 1
            else:
                x[:, b] = np.nan
    if count > 0:
        _truncate_some(A, y, rcond, some[:count], x, rank)


@kernel
def _truncate_some(A, y, rcond, some, x, rank):
    few, wanted = np.empty((*A.shape[:2], some.size)), np.empty((y.shape[0], some.size))
    found, ranks = np.empty((x.shape[0], some.size)), np.empty(some.size, np.int64)
    for i in range(A.shape[0]):
        for c in range(some.size):
            wanted[i, c] = y[i, some[c]]
        for j in range(A.shape[1]):
            for c in range(some.size):
                few[i, j, c] = A[i, j, some[c]]
    solve_truncated(few, wanted, rcond, found, ranks)
    for c in range(some.size):
        rank[some[c]] = ranks[c]
        for i in range(x.shape[0]):
            x[i, some[c]] = found[i, c]


@kernel
def least_squares(A, y, damping, rcond, x, rank):
    """Compute x[n, b] = argmin ||A x - y||^2 + damping^2 ||x||^2, and rank[b] of A[m, n, b].

    With damping 0 singular values below rcond * largest are truncated. A damped rank is not
    examined and reads as full.
    """
    bound = np.empty((1, A.shape[2]))
    _by_triangle(A, y, damping, x, bound)
    rank[:] = min(A.shape[0], A.shape[1])
    if damping == 0.0:
        _truncate(A, y, rcond, bound[0], x, rank)


@kernel
def least_squares_of_product(B, C, A, y, rcond, x, rank):
    """Compute x[n, b] = A^+ y and rank[b] of A = B C, with B[m, r, b] and C[r, n, b], r <= m, n.

    Where B and C have rank r, (B C)^+ = C^+ B^+ (Greville 1966), though A itself has no full rank
    if r < m, n: so no singular values are needed. The product of both bounds is a bound for A.
    """
    runs = x.shape[1]
    z, bound, other = np.empty((B.shape[1], runs)), np.empty((1, runs)), np.empty((1, runs))
    _by_triangle(B, y, 0.0, z, bound)
    _by_triangle(C, z, 0.0, x, other)
    for b in range(runs):
        bound[0, b] *= other[0, b]
        rank[b] = B.shape[1]
    _truncate(A, y, rcond, bound[0], x, rank)


@part
def invert(A, y, transposed, damping, rcond, x):
    """Compute x[n, b] = A^+ y, or A' y where `transposed`, for A[m, n, b] and y[m, b]."""
    if transposed:
        x[:] = 0.0
        for i in range(A.shape[0]):
            for j in range(A.shape[1]):
                for b in range(A.shape[2]):
                    x[j, b] += A[i, j, b] * y[i, b]
    else:
        rank = np.empty(A.shape[2], np.int64)
        least_squares(A, y, damping, rcond, x, rank)
