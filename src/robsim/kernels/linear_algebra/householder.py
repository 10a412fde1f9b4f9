"""QR factorisation of many small matrices by Householder reflections.

A matrix M is stored in column-major order. The factorisation M = H_0 H_1 ... R stores the vectors v
of the reflections H = I - beta v v' in the columns of M, from the diagonal on (Golub and Van Loan
2013, section 5.2).
"""

from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import absolute, get, put, sqrt, where


@part
def reflect_vector(w, v, first, rows, beta, x, stride):
    """Replace x by (I - beta v v') x. The vector v is zero before row `first`."""
    total = get(w, v + first) * get(w, x + stride * first)
    for i in range(first + 1, rows):
        total = total + get(w, v + i) * get(w, x + stride * i)
    total = get(w, beta) * total
    for i in range(first, rows):
        at = x + stride * i
        put(w, at, get(w, at) - total * get(w, v + i))


@kernel
def factorise_qr(w, M, rows, n, betas, R):
    """Factorise a matrix M (rows, n) in place. R (n, n) is upper triangular."""
    for j in range(n):
        v = M + j * rows
        square, head = get(w, v + j) * get(w, v + j), get(w, v + j)
        for i in range(j + 1, rows):
            square = square + get(w, v + i) * get(w, v + i)
        norm = sqrt(square)
        diagonal = where(head > 0.0, -norm, norm)
        put(w, R + j * n + j, diagonal)
        put(w, v + j, head - diagonal)
        size = norm * (norm + absolute(head))  # 0 for a column of zeros, which needs no reflection
        put(w, betas + j, where(size == 0.0, 0.0, 1.0 / size))
        for c in range(j + 1, n):
            reflect_vector(w, v, j, rows, betas + j, M + c * rows, 1)
            put(w, R + c * n + j, get(w, M + c * rows + j))


@kernel
def apply_reflections(w, M, rows, n, betas, x, stride):
    """Replace a vector x by ... H_1 H_0 x, which equals the row vector x' H_0 H_1 ..."""
    for j in range(n):
        reflect_vector(w, M + j * rows, j, rows, betas + j, x, stride)


@kernel
def apply_reflections_back(w, M, rows, n, betas, x):
    """Replace a vector x by H_0 H_1 ... x."""
    for j in range(n - 1, -1, -1):
        reflect_vector(w, M + j * rows, j, rows, betas + j, x, 1)
