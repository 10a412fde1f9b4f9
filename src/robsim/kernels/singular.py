"""Singular values of many small matrices at once, by one-sided Jacobi rotations, run last.

A run whose columns are orthogonal is left as it is while others still turn, so that its bits do
not depend on the runs beside it.
"""

import numpy as np

from robsim.kernels.block import gather_row, scatter_row, scatter_rows
from robsim.kernels.extremes import largest
from robsim.kernels.jit import kernel, part
from robsim.kernels.lanes import WIDTH, absolute, get, put, some, sqrt, where

SWEEPS = 60  # at most; six or seven are usual
STRAIGHT = 1e-15  # cosine of the angle between two columns that counts as zero


@part
def _rotation(block, p, q, rows):
    """Return cosine and sine of the rotation of two columns, and in which runs one is needed."""
    a, c, d = get(block, p), get(block, p), get(block, q)
    a, c, d = a * a, c * d, d * d
    for i in range(1, rows):
        x, y = get(block, p + i), get(block, q + i)
        a, c, d = a + x * x, c + x * y, d + y * y
    needed = absolute(c) > STRAIGHT * sqrt(a * d)
    zeta = (d - a) / (2.0 * where(needed, c, 1.0))
    t = where(zeta < 0.0, -1.0, 1.0) / (absolute(zeta) + sqrt(1.0 + zeta * zeta))
    cosine = 1.0 / sqrt(1.0 + t * t)
    return cosine, cosine * t, needed


@part
def _rotate(block, p, q, rows, cosine, sine, needed):
    for i in range(rows):
        x, y = get(block, p + i), get(block, q + i)
        put(block, p + i, where(needed, cosine * x - sine * y, x))
        put(block, q + i, where(needed, sine * x + cosine * y, y))


@kernel
def _orthogonalise(block, G, rows, n, V):
    """Rotate n columns of so many rows, and those of V (n rows), until they are orthogonal."""
    for _ in range(SWEEPS):
        straight = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                c, s, needed = _rotation(block, G + p * rows, G + q * rows, rows)
                if some(needed):
                    straight = False
                    _rotate(block, G + p * rows, G + q * rows, rows, c, s, needed)
                    _rotate(block, V + p * n, V + q * n, n, c, s, needed)
        if straight:
            return


@kernel
def singular_values(A, G, V, sigma):
    """Compute A[m, n, b] = G V' or its transpose; the columns of G have lengths sigma[k, b].

    k = min(m, n), and V[k, k, b] is orthogonal.
    """
    wide, (rows, n, runs) = A.shape[0] < A.shape[1], G.shape
    block = np.empty((rows + n + 1) * n * WIDTH)
    first_V, first_sigma = rows * n, (rows + n) * n
    for b in range(0, runs, WIDTH):
        for j in range(n):
            for i in range(n):
                put(block, first_V + j * n + i, 1.0 if i == j else 0.0)
            for i in range(rows):
                gather_row(A[j, i] if wide else A[i, j], b, j * rows + i, block)
        _orthogonalise(block, 0, rows, n, first_V)
        _lengths(block, rows, n, first_sigma)
        scatter_rows(block, first_sigma, b, sigma)
        for j in range(n):
            for i in range(n):
                scatter_row(block, first_V + j * n + i, b, V[i, j])
            for i in range(rows):
                scatter_row(block, j * rows + i, b, G[i, j])


@part
def _lengths(block, rows, n, out):
    """Compute the length of each of n columns."""
    for j in range(n):
        square = get(block, j * rows) * get(block, j * rows)
        for i in range(1, rows):
            square = square + get(block, j * rows + i) * get(block, j * rows + i)
        put(block, out + j, sqrt(square))


@kernel
def solve_truncated(A, y, rcond, x, rank):
    """Compute x[n, b] = A^+ y without singular values below rcond * largest, and rank[b]."""
    p, n, runs = max(A.shape[0], A.shape[1]), min(A.shape[0], A.shape[1]), A.shape[2]
    G, V, sigma = np.empty((p, n, runs)), np.empty((n, n, runs)), np.empty((n, runs))
    along, most = np.empty(runs), np.empty(runs)
    singular_values(A, G, V, sigma)
    largest(sigma, most)
    left, right = (V, G) if A.shape[0] < A.shape[1] else (G, V)
    x[:], rank[:] = 0.0, 0
    for k in range(n):
        along[:] = 0.0
        for i in range(y.shape[0]):
            for b in range(runs):
                along[b] += left[i, k, b] * y[i, b]
        for b in range(runs):
            counts = sigma[k, b] > rcond * most[b]
            rank[b] += counts
            along[b] = along[b] / (sigma[k, b] * sigma[k, b]) if counts else 0.0
        for i in range(x.shape[0]):
            for b in range(runs):
                x[i, b] += right[i, k, b] * along[b]
