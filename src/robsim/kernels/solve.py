"""Least squares x = A^+ y for many small systems at once, truncated or damped.

The usual way is a QR factorisation by modified Gram-Schmidt, which keeps the run innermost. It
yields R^-1 explicitly, and ||R|| ||R^-1|| (Frobenius) bounds the condition number from above: only
a run whose bound exceeds 1/rcond goes through its singular values, where those below
rcond * largest count as zero. Wide systems (more unknowns than equations) get the solution of
least norm, through the QR of A'.
"""

import math

import numpy as np

from robsim.kernels.jit import kernel, part
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


@part
def _upright(A, damping, Q):
    """Set Q to A or A', whichever has at least as many rows as columns, over damping * identity."""
    wide = A.shape[0] < A.shape[1]
    p, n = max(A.shape[0], A.shape[1]), min(A.shape[0], A.shape[1])
    Q[:] = 0.0
    for j in range(n):
        for i in range(p):
            for b in range(Q.shape[2]):
                Q[i, j, b] = A[j, i, b] if wide else A[i, j, b]
        if damping > 0.0:
            for b in range(Q.shape[2]):
                Q[p + j, j, b] = damping


@part
def _gram_schmidt(Q, R):
    """Orthonormalise the columns of Q, with R[i, j, b] upper triangular and Q_before = Q R."""
    rows, n, runs = Q.shape
    R[:] = 0.0
    for j in range(n):
        for i in range(rows):
            for b in range(runs):
                R[j, j, b] += Q[i, j, b] * Q[i, j, b]
        for b in range(runs):
            R[j, j, b] = math.sqrt(R[j, j, b])
        for i in range(rows):
            for b in range(runs):
                Q[i, j, b] /= R[j, j, b]
        for k in range(j + 1, n):
            for i in range(rows):
                for b in range(runs):
                    R[j, k, b] += Q[i, j, b] * Q[i, k, b]
            for i in range(rows):
                for b in range(runs):
                    Q[i, k, b] -= Q[i, j, b] * R[j, k, b]


@part
def _invert_triangle(R, inverse):
    """Compute inverse = R^-1 for upper triangular R, column by column."""
    n, runs = R.shape[1], R.shape[2]
    inverse[:] = 0.0
    for j in range(n):
        for b in range(runs):
            inverse[j, j, b] = 1.0 / R[j, j, b]
        for i in range(j - 1, -1, -1):
            for k in range(i + 1, j + 1):
                for b in range(runs):
                    inverse[i, j, b] -= R[i, k, b] * inverse[k, j, b]
            for b in range(runs):
                inverse[i, j, b] *= inverse[i, i, b]


@part
def _condition_bound(R, inverse, bound):
    """Compute bound[b] = ||R||_F ||R^-1||_F >= the condition number."""
    norm = np.zeros((2, R.shape[2]))
    for i in range(R.shape[0]):
        for j in range(i, R.shape[1]):
            for b in range(R.shape[2]):
                norm[0, b] += R[i, j, b] * R[i, j, b]
                norm[1, b] += inverse[i, j, b] * inverse[i, j, b]
    for b in range(R.shape[2]):
        bound[b] = math.sqrt(norm[0, b]) * math.sqrt(norm[1, b])


@part
def _solve_tall(Q, inverse, y, x):
    """Compute x = R^-1 Q' y, with y projected step by step, which keeps Gram-Schmidt stable."""
    rest, z = np.zeros((Q.shape[0], y.shape[1])), np.zeros(x.shape)
    for i in range(y.shape[0]):
        for b in range(y.shape[1]):
            rest[i, b] = y[i, b]
    for j in range(z.shape[0]):
        for i in range(Q.shape[0]):
            for b in range(y.shape[1]):
                z[j, b] += Q[i, j, b] * rest[i, b]
        for i in range(Q.shape[0]):
            for b in range(y.shape[1]):
                rest[i, b] -= Q[i, j, b] * z[j, b]
    x[:] = 0.0
    for i in range(x.shape[0]):
        for j in range(i, x.shape[0]):
            for b in range(x.shape[1]):
                x[i, b] += inverse[i, j, b] * z[j, b]


@part
def _solve_wide(Q, inverse, y, x):
    """Compute x = Q R^-T y."""
    z = np.zeros(y.shape)
    for j in range(y.shape[0]):
        for i in range(j + 1):
            for b in range(y.shape[1]):
                z[j, b] += inverse[i, j, b] * y[i, b]
    x[:] = 0.0
    for i in range(x.shape[0]):
        for j in range(y.shape[0]):
            for b in range(y.shape[1]):
                x[i, b] += Q[i, j, b] * z[j, b]


@kernel
def _is_finite(A, b):
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            if not math.isfinite(A[i, j, b]):
                return False
    return True


@kernel
def _by_triangle(A, y, damping, x, bound):
    """Compute x = A^+ y by a QR factorisation, and bound[b] >= the condition number of A."""
    p, n, runs = max(A.shape[0], A.shape[1]), min(A.shape[0], A.shape[1]), A.shape[2]
    Q = np.empty((p + n if damping > 0.0 else p, n, runs))
    R, inverse = np.empty((n, n, runs)), np.empty((n, n, runs))
    _upright(A, damping, Q)
    _gram_schmidt(Q, R)
    _invert_triangle(R, inverse)
    _condition_bound(R, inverse, bound)
    if A.shape[0] < A.shape[1]:
        _solve_wide(Q, inverse, y, x)
    else:
        _solve_tall(Q, inverse, y, x)


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
    bound = np.empty(A.shape[2])
    _by_triangle(A, y, damping, x, bound)
    rank[:] = min(A.shape[0], A.shape[1])
    if damping == 0.0:
        _truncate(A, y, rcond, bound, x, rank)


@kernel
def least_squares_of_product(B, C, A, y, rcond, x, rank):
    """Compute x[n, b] = A^+ y and rank[b] of A = B C, with B[m, r, b] and C[r, n, b], r <= m, n.

    Where B and C have rank r, (B C)^+ = C^+ B^+ (Greville 1966), though A itself has no full rank
    if r < m, n: so no singular values are needed. The product of both bounds is a bound for A.
    """
    z, bound, other = np.empty((B.shape[1], x.shape[1])), np.empty(x.shape[1]), np.empty(x.shape[1])
    _by_triangle(B, y, 0.0, z, bound)
    _by_triangle(C, z, 0.0, x, other)
    for b in range(bound.size):
        bound[b] *= other[b]
        rank[b] = B.shape[1]
    _truncate(A, y, rcond, bound, x, rank)


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
