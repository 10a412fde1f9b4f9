"""Damped least squares by normal equations and Cholesky factors, for many small systems.

Faster than `robsim.kernels.solve`, and good for steps that are damped: the condition number is
squared, so an undamped system that is nearly singular is not for these.
"""

import math

import numpy as np

from robsim.kernels.jit import kernel, part


@part
def _gram(A, damping, H):
    """Compute the lower half of H[k, k, b] = A'A, or A A' if smaller, plus damping[b] identity."""
    wide = A.shape[0] < A.shape[1]
    for i in range(H.shape[0]):
        for j in range(i + 1):
            for b in range(H.shape[2]):
                H[i, j, b] = damping[b] if i == j else 0.0
            for k in range(max(A.shape[0], A.shape[1])):
                for b in range(H.shape[2]):
                    H[i, j, b] += A[i, k, b] * A[j, k, b] if wide else A[k, i, b] * A[k, j, b]


@part
def _factorise(H):
    """Replace the lower half of H by L with H = L L' and an inverted diagonal, in place."""
    for j in range(H.shape[0]):
        for k in range(j):
            for i in range(j, H.shape[0]):
                for b in range(H.shape[2]):
                    H[i, j, b] -= H[i, k, b] * H[j, k, b]
        for b in range(H.shape[2]):
            H[j, j, b] = 1.0 / math.sqrt(H[j, j, b])
        for i in range(j + 1, H.shape[0]):
            for b in range(H.shape[2]):
                H[i, j, b] *= H[j, j, b]


@part
def _substitute(H, x):
    """Replace x by (L L')^-1 x, by forward and back substitution, in place."""
    n = H.shape[0]
    for i in range(n):
        for k in range(i):
            for b in range(x.shape[1]):
                x[i, b] -= H[i, k, b] * x[k, b]
        for b in range(x.shape[1]):
            x[i, b] *= H[i, i, b]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            for b in range(x.shape[1]):
                x[i, b] -= H[k, i, b] * x[k, b]
        for b in range(x.shape[1]):
            x[i, b] *= H[i, i, b]


@kernel
def transposed_product(A, y, x):
    """Compute x[n, b] = A' y for A[m, n, b] and y[m, b]."""
    for j in range(A.shape[1]):
        for b in range(x.shape[1]):
            x[j, b] = 0.0
        for i in range(A.shape[0]):
            for b in range(x.shape[1]):
                x[j, b] += A[i, j, b] * y[i, b]


@kernel
def damped_step(A, y, downhill, damping, x):
    """Compute x[n, b] = argmin ||A x - y||^2 + damping[b] ||x||^2, for downhill[n, b] = A' y.

    (A'A + damping I)^-1 A' y = A' (A A' + damping I)^-1 y: the smaller system is solved.
    """
    wide = A.shape[0] < A.shape[1]
    n = min(A.shape[0], A.shape[1])
    H, z = np.empty((n, n, A.shape[2])), np.empty((n, A.shape[2]))
    _gram(A, damping, H)
    _factorise(H)
    for i in range(n):
        for b in range(A.shape[2]):
            z[i, b] = y[i, b] if wide else downhill[i, b]
    _substitute(H, z)
    if wide:
        transposed_product(A, z, x)
    else:
        for i in range(n):
            for b in range(A.shape[2]):
                x[i, b] = z[i, b]
