"""Tasks in order of priority, each within what those before it leave free.

Usually each task has full rank within what is left, whose orthonormal basis N then has as many
columns as there are numbers left: a QR factorisation of A N serves it, and shortens N. Only a run
in which the condition of A N is doubtful goes through singular values, with the projector P onto
what is left in place of N. There rank is decided once for each direction, relative to the largest
singular value of the task's own matrix A. What a task of higher priority left of it, A P, may be
nothing but rounding, and a threshold relative to A P would invert that.
"""

import numpy as np

from robsim.kernels.linear_algebra import svd
from robsim.kernels.linear_algebra.householder import (
    apply_reflections,
    apply_reflections_back,
    factorise_qr,
)
from robsim.kernels.linear_algebra.pseudoinverse import apply_inverse, invert_triangle
from robsim.kernels.linear_algebra.svd import decompose_columns, greatest_row
from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import any_lane, get, put, where
from robsim.kernels.machine.stages import stage


def count_priority_rows(k: int, n: int) -> int:
    """Return how many rows `solve_priority` needs to work in."""
    m = min(k, n)
    usual = k * n + 2 * m + 2 * m * m + max(k, n)
    return n + n * n + k + max(usual, svd.count_truncation_rows(k, n) + n + k * n)


@stage
def solve_priority(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    rate="k",
    rcond="row",
    free="whole",
    qd="n",
    P="n, n",
    N="n, n",
    usual="row",
    scratch="size",
    size="count",
):
    """Add (A P)^+ (rate - A qd) to qd (n,), and subtract (A P)^+ A P from P (n, n).

    (A, k, n, rate, rcond, free, qd, P, N, usual, scratch). Singular values of A P below rcond times
    the largest of A count as zero. `free` numbers are left, n for the first task; N (n, n) holds
    their basis column by column in the runs in which the row `usual` is 1.
    """
    given = A, k, n, rate, rcond, free, qd, P, N, usual, scratch
    if free == n:
        _begin_null_space(w, n, qd, P, N, usual)
    late, left = scratch, scratch + n
    _remaining_rate(w, given, left + n * n)
    bound = _solve_by_reflections(w, given, late, left)
    _shorten_basis(w, n, free, min(k, free), N, 0.0 * get(w, rcond), left)
    sound = (bound < 1.0) & (get(w, usual) > 0.0)
    put(w, usual, where(sound, 1.0, 0.0))
    if any_lane(~sound):
        _solve_by_singular_values(w, given)
    for i in range(n):
        put(w, qd + i, where(sound, get(w, late + i), get(w, qd + i)))
    for i in range(n * n):
        put(w, P + i, where(sound, get(w, left + i), get(w, P + i)))


@part
def _begin_null_space(w, n, qd, P, N, usual):
    for i in range(n):
        put(w, qd + i, 0.0)
        for j in range(n):
            put(w, P + n * i + j, 1.0 if i == j else 0.0)
            put(w, N + n * i + j, 1.0 if i == j else 0.0)
    put(w, usual, 1.0)


@kernel
def _remaining_rate(w, p, out):
    """Compute what is left of a wanted rate, out = rate - A qd."""
    A, n, qd = p[0], p[2], p[6]
    for i in range(p[1]):
        total = get(w, p[3] + i)
        for j in range(n):
            total = total - get(w, A + n * i + j) * get(w, qd + j)
        put(w, out + i, total)


@part
def _solve_by_reflections(w, p, late, left):
    """Compute qd + N (A N)^+ rest, and turn N so that its last columns are what is left.

    Return what is below 1 where A N certainly has full rank.
    """
    A, k, n, free, N = p[0], p[1], p[2], p[5], p[8]
    rest, m, wide = left + n * n, min(k, free), k < free
    M, height = rest + k, free if wide else k
    betas, R = M + m * height, M + m * height + m
    inverse, x = R + m * m, R + 2 * m * m
    _multiply_basis(w, A, k, n, N, free, M, wide)
    factorise_qr(w, M, height, m, betas, R)
    for j in range(m):
        put(w, inverse + j * m + j, 1.0 / get(w, R + j * m + j))
    invert_triangle(w, R, m, inverse)
    if wide:
        _solve_least_norm(w, inverse, m, rest, M, height, betas, x)
    else:
        _solve_least_squares(w, inverse, m, rest, M, height, betas, x)
    _add_null_space_motion(w, n, p[6], N, free, x, late)
    if wide:
        for i in range(n):
            apply_reflections(w, M, height, m, betas, N + i, n)
    return _squared_condition_bound(w, A, k * n, inverse, m, get(w, p[4]))


@part
def _multiply_basis(w, A, k, n, N, free, M, wide):
    """Compute A N, column by column, or its transpose where it is `wide`."""
    for i in range(k):
        for j in range(free):
            total = get(w, A + n * i) * get(w, N + n * j)
            for c in range(1, n):
                total = total + get(w, A + n * i + c) * get(w, N + n * j + c)
            put(w, M + (free * i + j if wide else k * j + i), total)


@part
def _add_null_space_motion(w, n, qd, N, free, x, out):
    """Compute velocities with a share of the null space, out = qd + N x."""
    for i in range(n):
        total = get(w, qd + i)
        for j in range(free):
            total = total + get(w, N + n * j + i) * get(w, x + j)
        put(w, out + i, total)


@part
def _solve_least_norm(w, inverse, m, rest, M, height, betas, x):
    """Compute x = H R^-T rest, the solution of least norm of R' H' x = rest."""
    for j in range(height):
        total = 0.0 * get(w, rest)
        if j < m:
            for i in range(j + 1):
                total = total + get(w, inverse + j * m + i) * get(w, rest + i)
        put(w, x + j, total)
    apply_reflections_back(w, M, height, m, betas, x)


@part
def _solve_least_squares(w, inverse, m, rest, M, height, betas, x):
    """Compute x = R^-1 H' rest, of the least residual of H R x = rest; `rest` is spoilt."""
    apply_reflections(w, M, height, m, betas, rest, 1)
    apply_inverse(w, inverse, m, rest, x)


@part
def _squared_condition_bound(w, A, size, inverse, m, rcond):
    """Return (rcond ||A|| ||R^-1||)^2 in Frobenius' norms; NaN if A is not finite."""
    direct, back = 0.0 * rcond, 0.0 * rcond
    for i in range(size):
        direct = direct + get(w, A + i) * get(w, A + i)
    for j in range(m):
        for i in range(j + 1):
            back = back + get(w, inverse + j * m + i) * get(w, inverse + j * m + i)
    return rcond * rcond * direct * back


@part
def _shorten_basis(w, n, free, m, N, zero, P):
    """Keep the columns of N from m on, and compute the projector P = N N' onto what is left."""
    for i in range(n * (free - m)):
        put(w, N + i, get(w, N + n * m + i))
    for i in range(n):
        for j in range(i + 1):
            total = zero
            for c in range(free - m):
                total = total + get(w, N + n * c + i) * get(w, N + n * c + j)
            put(w, P + n * i + j, total)
            put(w, P + n * j + i, total)


@part
def _solve_by_singular_values(w, p):
    """Compute the same with the singular values of A P, and P in place of N."""
    A, k, n, free, rcond, qd, P = p[0], p[1], p[2], p[5], get(w, p[4]), p[6], p[7]
    m, tall = min(k, n), max(k, n)
    rest = p[10] + n + n * n
    G = rest + k
    V, sigma = G + tall * m, G + tall * m + m * m
    room = sigma + m
    most = _decompose_task(w, A, k, n, G, V, sigma)
    total = most
    if free < n:
        _project_jacobian(w, A, k, n, P, room + n)
        total = most + _decompose_task(w, room + n, k, n, G, V, sigma)
    _remaining_rate(w, p, rest)
    left, height, right, width = (V, m, G, tall) if k < n else (G, tall, V, m)
    for s in range(m):  # A P = left right', one of them orthonormal
        along = 0.0 * most
        for i in range(k):
            along = along + get(w, left + height * s + i) * get(w, rest + i)
        size = get(w, sigma + s)
        taken = size > rcond * most
        _take_direction(w, right + width * s, along / (size * size), taken, n, room, qd, P)
    broken = ~(total * 0.0 == 0.0)
    _set_nan(w, qd, n, broken)
    _set_nan(w, P, n * n, broken)


@part
def _set_nan(w, x, n, broken):
    for i in range(n):
        put(w, x + i, where(broken, np.nan, get(w, x + i)))


@part
def _project_jacobian(w, A, k, n, P, out):
    """Compute a task Jacobian within a null space, A P."""
    for i in range(k):
        for j in range(n):
            total = 0.0 * get(w, A)
            for c in range(n):
                total = total + get(w, A + n * i + c) * get(w, P + n * c + j)
            put(w, out + n * i + j, total)


@part
def _take_direction(w, direction, along, taken, n, free, qd, P):
    """Add `along` times the free part P direction to qd, and remove that direction from P.

    Only in the runs that are `taken`. The direction lies in the range of P but for rounding;
    projecting it once more keeps what was taken before undisturbed even where the motion is large,
    near a conflict.
    """
    square = 0.0 * along
    for i in range(n):
        total = 0.0 * along
        for j in range(n):
            total = total + get(w, P + n * i + j) * get(w, direction + j)
        put(w, free + i, total)
        square = square + total * total
    for i in range(n):
        here = get(w, free + i)
        put(w, qd + i, get(w, qd + i) + where(taken, here * along, 0.0))
        for j in range(n):
            less = where(taken, here * get(w, free + j) / square, 0.0)
            put(w, P + n * i + j, get(w, P + n * i + j) - less)


@kernel
def _decompose_task(w, A, k, n, G, V, sigma):
    """Decompose A = G V' or its transpose, whichever is tall; return the largest singular value."""
    p, m = max(k, n), min(k, n)
    for j in range(m):
        for i in range(p):
            put(w, G + j * p + i, get(w, A + (j * n + i if k < n else i * n + j)))
    decompose_columns(w, G, p, m, V, sigma)
    return _greatest_or_nan(w, sigma, m)


@part
def _greatest_or_nan(w, x, n):
    """Return the largest of n numbers; NaN or infinite if any of them is."""
    total = 0.0 * get(w, x)
    for i in range(1, n):
        total = total + 0.0 * get(w, x + i)
    return greatest_row(w, x, n) + total
