"""Singular values of many small matrices at once, by one-sided Jacobi rotations, run last.

A run whose columns are orthogonal is left as it is while others still turn, so that its bits do
not depend on the runs beside it.
"""

import math

import numpy as np

from robsim.kernels.jit import kernel, part

SWEEPS = 60  # at most; six or seven are usual
STRAIGHT = 1e-15  # cosine of the angle between two columns that counts as zero


@part
def _products(G, p, q, dots):
    """Compute dots[:, b] = (G_p G_p, G_q G_q, G_p G_q) of two columns."""
    dots[:] = 0.0
    for i in range(G.shape[0]):
        for b in range(G.shape[2]):
            dots[0, b] += G[i, p, b] * G[i, p, b]
            dots[1, b] += G[i, q, b] * G[i, q, b]
            dots[2, b] += G[i, p, b] * G[i, q, b]


@part
def _rotations(dots, turns):
    """Compute turns[:, b] = (cosine, sine) of each rotation; (1, 0) where none is needed."""
    count = 0
    for b in range(dots.shape[1]):
        c = dots[2, b]
        needed = abs(c) > STRAIGHT * math.sqrt(dots[0, b] * dots[1, b])
        zeta = (dots[1, b] - dots[0, b]) / (2.0 * (c if needed else 1.0))
        t = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
        cosine = 1.0 / math.sqrt(1.0 + t * t)
        turns[0, b] = cosine if needed else 1.0
        turns[1, b] = cosine * t if needed else 0.0
        count += needed
    return count


@kernel
def _rotate(G, p, q, turns):
    for i in range(G.shape[0]):
        for b in range(G.shape[2]):
            c, s, x, y = turns[0, b], turns[1, b], G[i, p, b], G[i, q, b]
            G[i, p, b] = c * x - s * y if s != 0.0 else x
            G[i, q, b] = s * x + c * y if s != 0.0 else y


@kernel
def _orthogonalise(G, V):
    """Rotate the columns of G[m, n, b], and those of V, until they are orthogonal."""
    n, runs = G.shape[1], G.shape[2]
    dots, turns = np.empty((3, runs)), np.empty((2, runs))
    for _ in range(SWEEPS):
        turned = 0
        for p in range(n - 1):
            for q in range(p + 1, n):
                _products(G, p, q, dots)
                count = _rotations(dots, turns)
                turned += count
                if count > 0:
                    _rotate(G, p, q, turns)
                    _rotate(V, p, q, turns)
        if turned == 0:
            return


@kernel
def singular_values(A, G, V, sigma):
    """Compute A[m, n, b] = G V' or its transpose; the columns of G have lengths sigma[k, b].

    k = min(m, n), and V[k, k, b] is orthogonal.
    """
    wide, runs = A.shape[0] < A.shape[1], A.shape[2]
    V[:] = 0.0
    for j in range(G.shape[1]):
        V[j, j] = 1.0
        for i in range(G.shape[0]):
            for b in range(runs):
                G[i, j, b] = A[j, i, b] if wide else A[i, j, b]
    _orthogonalise(G, V)
    sigma[:] = 0.0
    for j in range(G.shape[1]):
        for i in range(G.shape[0]):
            for b in range(runs):
                sigma[j, b] += G[i, j, b] * G[i, j, b]
        for b in range(runs):
            sigma[j, b] = math.sqrt(sigma[j, b])


@kernel
def largest(sigma, out):
    """Compute out[b] = max_k sigma[k, b]; NaN if one is not finite."""
    out[:] = 0.0
    for k in range(sigma.shape[0]):
        for b in range(out.size):
            out[b] = max(out[b], sigma[k, b])
    for k in range(sigma.shape[0]):
        for b in range(out.size):
            out[b] += sigma[k, b] * 0.0


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
