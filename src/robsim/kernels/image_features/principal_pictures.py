"""Principal components of a few pictures, in an order of operations that no machine changes."""

import math

import numpy as np

from robsim.kernels.image_features.picture_sums import LANES, compute_gram_matrix
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

SWEEPS = 30  # of the method of Jacobi; ten suffice for a hundred pictures
LEAST_SHARE = 1e-12  # share of the squares outside of the diagonal at which it ends


@entry("out float32[:, ::1], out float32[:, ::1], out float64[::1]")
def find_principal_pictures(pictures, basis, variances):
    """Compute the orthonormal principal components of pictures without their mean.

    Parameters
    ----------
    pictures : array of float32, shape (M, N), N a multiple of LANES
        Pictures, which are replaced by their differences from the mean.
    basis : array of float32, shape (k, N), k < M
        The principal components with the largest variances, the result. A component has the sign
        that makes its first coefficient of the largest size positive.
    variances : array of shape (M,)
        Squares of the singular values, the largest first, the result.
    """
    partial, gram = np.empty(LANES, dtype=np.float32), np.empty((len(pictures), len(pictures)))
    vectors = np.empty_like(gram)
    _subtract_mean(pictures)
    compute_gram_matrix(pictures, partial, gram)
    diagonalise(gram, vectors)
    used = np.zeros(len(pictures), dtype=np.uint8)
    for i in range(len(pictures)):
        best = -1
        for j in range(len(pictures)):
            if not used[j] and (best < 0 or gram[j, j] > gram[best, best]):
                best = j
        used[best] = 1
        variances[i] = gram[best, best]
        if i < len(basis):
            _combine_pictures(pictures, vectors[:, best], gram[best, best], basis[i])


@kernel
def _subtract_mean(pictures):
    """Subtract the mean (N,) from pictures (M, N), in place."""
    mean = np.zeros(pictures.shape[1])
    for m in range(len(pictures)):
        for n in range(mean.size):
            mean[n] += pictures[m, n]
    for m in range(len(pictures)):
        for n in range(mean.size):
            pictures[m, n] -= mean[n] / len(pictures)


@kernel
def _combine_pictures(pictures, vector, square, out):
    """Compute the unit picture out (N,), the sum of the pictures times a unit vector (M,)."""
    total, first = np.zeros(out.size), 0
    for m in range(vector.size):
        if abs(vector[m]) > abs(vector[first]) * (1.0 + 1e-9):
            first = m
    scale = math.copysign(1.0 / math.sqrt(square) if square > 0.0 else 0.0, vector[first])
    for m in range(vector.size):
        factor = vector[m] * scale
        for n in range(out.size):
            total[n] += factor * pictures[m, n]
    for n in range(out.size):
        out[n] = total[n]


@kernel
def diagonalise(matrix, vectors):
    """Diagonalise a symmetric matrix (M, M) in place by cyclic rotations of Jacobi.

    The columns of `vectors` (M, M) become its eigenvectors, in the order of the diagonal (Golub and
    Van Loan 2013, "Matrix Computations", section 8.5).
    """
    M = len(matrix)
    for i in range(M):
        for j in range(M):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        off, whole = 0.0, 0.0
        for i in range(M):
            for j in range(M):
                square = matrix[i, j] * matrix[i, j]
                whole += square
                off += square if i != j else 0.0
        if off <= LEAST_SHARE * LEAST_SHARE * whole:
            return
        for p in range(M - 1):
            for q in range(p + 1, M):
                _rotate_pair(matrix, vectors, p, q)


@kernel
def _rotate_pair(matrix, vectors, p, q):
    """Make the elements (p, q) and (q, p) of a symmetric matrix zero by a rotation."""
    if matrix[p, q] == 0.0:
        return
    half = (matrix[q, q] - matrix[p, p]) / (2.0 * matrix[p, q])
    t = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
    c = 1.0 / math.sqrt(1.0 + t * t)
    s = t * c
    for k in range(len(matrix)):
        a, b = matrix[p, k], matrix[q, k]
        matrix[p, k], matrix[q, k] = c * a - s * b, s * a + c * b
    for k in range(len(matrix)):
        a, b = matrix[k, p], matrix[k, q]
        matrix[k, p], matrix[k, q] = c * a - s * b, s * a + c * b
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = c * a - s * b, s * a + c * b
