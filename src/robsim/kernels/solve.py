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
def _orthogonalise(G, V):
    """Rotate the columns of G (and V) until they are orthogonal (one-sided Jacobi)."""
    n = G.shape[1]
    for _ in range(60):
        still = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                a, b, c = 0.0, 0.0, 0.0
                for i in range(G.shape[0]):
                    a += G[i, p] * G[i, p]
                    b += G[i, q] * G[i, q]
                    c += G[i, p] * G[i, q]
                if abs(c) > 1e-15 * math.sqrt(a * b) and c != 0.0:
                    still = False
                    zeta = (b - a) / (2.0 * c)
                    t = math.copysign(1.0, zeta) / (abs(zeta) + math.hypot(1.0, zeta))
                    cosine = 1.0 / math.hypot(1.0, t)
                    _rotate(G, p, q, cosine, cosine * t)
                    _rotate(V, p, q, cosine, cosine * t)
        if still:
            return


@kernel
def _rotate(G, p, q, c, s):
    for i in range(G.shape[0]):
        x, y = G[i, p], G[i, q]
        G[i, p], G[i, q] = c * x - s * y, s * x + c * y


@kernel
def singular_values(A, b, G, V, sigma):
    """Compute A[:, :, b] = G V' or its transpose; the columns of G have lengths sigma."""
    wide = A.shape[0] < A.shape[1]
    V[:] = 0.0
    for j in range(G.shape[1]):
        V[j, j] = 1.0
        for i in range(G.shape[0]):
            G[i, j] = A[j, i, b] if wide else A[i, j, b]
    _orthogonalise(G, V)
    for j in range(G.shape[1]):
        square = 0.0
        for i in range(G.shape[0]):
            square += G[i, j] * G[i, j]
        sigma[j] = math.sqrt(square)


@kernel
def _solve_truncated(A, y, b, rcond, x):
    """Compute x = A^+ y for run b by singular values; return the rank."""
    wide = A.shape[0] < A.shape[1]
    p, n = max(A.shape[0], A.shape[1]), min(A.shape[0], A.shape[1])
    G, V, sigma = np.empty((p, n)), np.empty((n, n)), np.empty(n)
    singular_values(A, b, G, V, sigma)
    largest, rank = 0.0, 0
    for k in range(n):
        largest = max(largest, sigma[k])
    for i in range(x.shape[0]):
        x[i, b] = 0.0
    left, right = (V, G) if wide else (G, V)
    for k in range(n):
        if sigma[k] > rcond * largest:
            rank += 1
            along = 0.0
            for i in range(y.shape[0]):
                along += left[i, k] * y[i, b]
            along /= sigma[k] ** 2
            for i in range(x.shape[0]):
                x[i, b] += right[i, k] * along
    return rank


@kernel
def _is_finite(A, b):
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            if not math.isfinite(A[i, j, b]):
                return False
    return True


@kernel
def least_squares(A, y, damping, rcond, x, rank):
    """Compute x[n, b] = argmin ||A x - y||^2 + damping^2 ||x||^2, and rank[b] of A[m, n, b].

    With damping 0 singular values below rcond * largest are truncated. A damped rank is not
    examined and reads as full.
    """
    p, n, runs = max(A.shape[0], A.shape[1]), min(A.shape[0], A.shape[1]), A.shape[2]
    Q = np.empty((p + n if damping > 0.0 else p, n, runs))
    R, inverse, bound = np.empty((n, n, runs)), np.empty((n, n, runs)), np.empty(runs)
    _upright(A, damping, Q)
    _gram_schmidt(Q, R)
    _invert_triangle(R, inverse)
    _condition_bound(R, inverse, bound)
    if A.shape[0] < A.shape[1]:
        _solve_wide(Q, inverse, y, x)
    else:
        _solve_tall(Q, inverse, y, x)
    for b in range(runs):
        rank[b] = n
        if damping == 0.0 and not bound[b] * rcond < 1.0:
            if _is_finite(A, b):
                rank[b] = _solve_truncated(A, y, b, rcond, x)
            else:
                for i in range(x.shape[0]):
                    x[i, b] = np.nan


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
