"""Least squares by a QR factorisation (modified Gram-Schmidt), on blocks of runs."""

from robsim.kernels.jit import part
from robsim.kernels.lanes import get, put, sqrt
from robsim.kernels.linked import linked
from robsim.kernels.stage import stage


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
def _invert_triangle(block, R, n, inverse):
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


@stage
def triangle(p, block, step):
    """Compute x = A^+ y by a QR factorisation: (A, k, n, y, damping or -1, x, scratch).

    The first row of `scratch` becomes a bound of the condition number of A.
    """
    A, k, n, y, damping, x, bound = p[0], p[1], p[2], p[3], p[4], p[5], p[6]
    wide, m, tall = k < n, min(k, n), max(k, n)
    rows = tall + m if damping >= 0 else tall
    Q, R = bound + 1, bound + 1 + rows * m
    inverse = R + m * m
    wanted, found = inverse + m * m, inverse + m * m + rows
    for j in range(m):
        for i in range(tall):
            put(block, Q + j * rows + i, get(block, A + (j * n + i if wide else i * n + j)))
        for i in range(tall, rows):
            put(block, Q + j * rows + i, 0.0)
        if damping >= 0:
            put(block, Q + j * rows + tall + j, get(block, damping))
    for i in range(rows):
        put(block, wanted + i, 0.0)
    for i in range(k):
        put(block, wanted + i, get(block, y + i))
    _orthonormalise(block, Q, rows, m, R)
    _invert_triangle(block, R, m, inverse)
    _condition_bound(block, R, inverse, m, bound)
    if wide:
        _solve_wide(block, Q, rows, m, inverse, wanted, found, tall)
    else:
        _solve_tall(block, Q, rows, m, inverse, wanted, found)
    for i in range(n):
        put(block, x + i, get(block, found + i))


_triangle = linked(triangle)


@part
def by_triangle(block, A, k, n, y, damping, x, scratch):
    """Compute x = A^+ y by a QR factorisation; return a bound of the condition number of A.

    `damping` is a row, or -1 where there is none.
    """
    _triangle(block, (A, k, n, y, damping, x, scratch))
    return get(block, scratch)
