"""Tasks in order of priority: each task is solved in the null space of the tasks before it.

Usually the task matrix A has full rank in the remaining null space, and an orthonormal basis N of
this space has as many columns as there are free numbers. A QR factorisation of A N then solves the
task and shortens N. If the condition of A N is doubtful in a run, the run uses singular values, and
from then on the projector P onto the null space instead of N. The rank is decided for each
direction, relative to the largest singular value of A. A threshold relative to A P would be wrong:
tasks of higher priority may leave only rounding errors in A P, and these would be inverted.

Tasks of one camera and more than six joints are solved in the six coordinates of a row space, see
`robsim.kernels.control.row_space`, as A N then never has full rank.
"""

import numpy as np

from robsim.kernels.control.free_motions import put_projector
from robsim.kernels.control.row_space import multiply_triangle
from robsim.kernels.linear_algebra import svd
from robsim.kernels.linear_algebra.householder import (
    apply_reflections,
    apply_reflections_back,
    factorise_qr,
)
from robsim.kernels.linear_algebra.pseudoinverse import apply_inverse, invert_triangle
from robsim.kernels.linear_algebra.svd import decompose_columns, greatest_row
from robsim.kernels.machine.intrinsics import routine
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import any_lane, get, put, where
from robsim.kernels.machine.stages import stage


def count_priority_rows(k: int, n: int) -> int:
    """Return the number of scratch rows that `solve_priority` needs."""
    m = min(k, n)
    usual = k * n + 2 * m + 2 * m * m + max(k, n)
    return n + k + max(usual, svd.count_truncation_rows(k, n) + n + k * n)


@stage
def solve_priority(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    rate="k",
    rcond="row",
    first="whole",
    free="whole",
    qd="n",
    P="n, n",
    N="n, n",
    usual="row",
    scratch="size",
    size="count",
):
    """Add (A P)^+ (rate - A qd) to qd (n,), and subtract (A P)^+ A P from the projector P (n, n).

    Singular values of A P below rcond times the largest singular value of A count as zero. `first`
    is 1 for the first task. In the runs with usual = 1, the first `free` columns of N, stored in
    column-major order, are a basis of the null space, and P is not computed.
    """
    numbers = A, k, n, rate, rcond, free, qd, P, N, usual, scratch, first
    if first:
        for i in range(n):
            put(w, qd + i, 0.0)
        put(w, usual, 1.0)
        _put_identity(w, n, N)
    new_qd, rest = scratch, scratch + n
    _remaining_rate(w, numbers, rest)
    bound = _solve_by_reflections(w, numbers, new_qd, rest)
    had_basis = get(w, usual) > 0.0
    sound = (bound < 1.0) & had_basis
    put(w, usual, where(sound, 1.0, 0.0))
    doubtful = any_lane(~sound)
    if doubtful:
        if first:
            _put_identity(w, n, P)
        else:
            put_projector(w, n, N, free, had_basis, P)
    _shorten_basis(w, k, n, free, N, rest + k)
    if doubtful:
        _solve_by_singular_values(w, numbers)
    for i in range(n):
        put(w, qd + i, where(sound, get(w, new_qd + i), get(w, qd + i)))


@stage
def find_null_space(
    w,
    step,
    L="k, 6",
    k="count",
    R="6, 6",
    bound="row",
    rcond="row",
    P="6, 6",
    scratch="size",
    size="count",
):
    """Compute the projector P onto the null space of L R' for an upper triangle R.

    P is zero in the runs in which L R' has full rank, as `bound`, a bound of its condition, is
    below 1/rcond.
    """
    usual = get(w, bound) * get(w, rcond) < 1.0
    _put_identity(w, 6, P)
    if any_lane(~usual):
        A, rest = scratch, scratch + 6 * k
        multiply_triangle(w, L, k, R, A)
        for i in range(k + 6):
            put(w, rest + i, 0.0)
        room = rest + k + 6
        _solve_by_singular_values(w, (A, k, 6, rest, rcond, 6, rest + k, P, P, bound, room, 1))
    for i in range(36):
        put(w, P + i, where(usual, 0.0, get(w, P + i)))


def count_null_space_rows(k: int) -> int:
    """Return the number of scratch rows that `find_null_space` needs."""
    return 6 * k + k + 6 + count_priority_rows(k, 6)


@part
def _put_identity(w, n, M):
    """Compute the identity matrix M (n, n)."""
    for i in range(n):
        for j in range(n):
            put(w, M + n * i + j, 1.0 if i == j else 0.0)


@kernel
def _remaining_rate(w, p, out):
    """Compute the remaining rate of a task, out = rate - A qd."""
    A, n, qd = p[0], p[2], p[6]
    for i in range(p[1]):
        total = get(w, p[3] + i)
        for j in range(n):
            total = total - get(w, A + n * i + j) * get(w, qd + j)
        put(w, out + i, total)


@part
def _solve_by_reflections(w, p, late, rest):
    """Compute qd + N (A N)^+ rest. Return a bound: A N has full rank if the bound is below 1."""
    A, k, n, free, N = p[0], p[1], p[2], p[5], p[8]
    m, wide = min(k, free), k < free
    M, height = rest + k, free if wide else k
    betas, R = M + m * height, M + m * height + m
    inverse, x = R + m * m, R + 2 * m * m
    _multiply_basis(w, A, k, n, N, free, M, wide)
    factorise_qr(w, M, height, m, betas, R)
    invert_triangle(w, R, m, inverse)
    if wide:
        _solve_least_norm(w, inverse, m, rest, M, height, betas, x)
    else:
        _solve_least_squares(w, inverse, m, rest, M, height, betas, x)
    _add_null_space_motion(w, n, p[6], N, free, x, late)
    return _squared_condition_bound(w, A, k * n, inverse, m, get(w, p[4]))


@part
def _multiply_basis(w, A, k, n, N, free, M, wide):
    """Compute A N in column-major order, or its transpose if A N is `wide`."""
    for i in range(k):
        for j in range(free):
            total = get(w, A + n * i) * get(w, N + n * j)
            for c in range(1, n):
                total = total + get(w, A + n * i + c) * get(w, N + n * j + c)
            put(w, M + (free * i + j if wide else k * j + i), total)


@part
def _add_null_space_motion(w, n, qd, N, free, x, out):
    """Compute out = qd + N x."""
    for i in range(n):
        total = get(w, qd + i)
        for j in range(free):
            total = total + get(w, N + n * j + i) * get(w, x + j)
        put(w, out + i, total)


@part
def _solve_least_norm(w, inverse, m, rest, M, height, betas, x):
    """Compute x = H R^-T rest, the least-norm solution of R' H' x = rest."""
    for j in range(height):
        total = 0.0 * get(w, rest)
        if j < m:
            for i in range(j + 1):
                total = total + get(w, inverse + j * m + i) * get(w, rest + i)
        put(w, x + j, total)
    apply_reflections_back(w, M, height, m, betas, x)


@part
def _solve_least_squares(w, inverse, m, rest, M, height, betas, x):
    """Compute x = R^-1 H' rest, the least-squares solution of H R x = rest. Overwrite `rest`."""
    apply_reflections(w, M, height, m, betas, rest, 1)
    apply_inverse(w, inverse, m, rest, x)


@part
def _squared_condition_bound(w, A, size, inverse, m, rcond):
    """Return (rcond ||A|| ||R^-1||)^2 in Frobenius norms; NaN if A is not finite."""
    norm, inverse_norm = 0.0 * rcond, 0.0 * rcond
    for i in range(size):
        norm = norm + get(w, A + i) * get(w, A + i)
    for j in range(m):
        for i in range(j + 1):
            inverse_norm = inverse_norm + get(w, inverse + j * m + i) * get(w, inverse + j * m + i)
    return rcond * rcond * norm * inverse_norm


@part
def _shorten_basis(w, k, n, free, N, M):
    """Rotate N so that its last columns span the new null space, and keep only these columns.

    M holds the reflections of `_solve_by_reflections`.
    """
    if k < free:
        for i in range(n):
            apply_reflections(w, M, free, k, M + k * free, N + i, n)
        for i in range(n * (free - k)):
            put(w, N + i, get(w, N + n * k + i))


@routine
def _solve_by_singular_values(w, p):
    """Update qd and P by the singular values of A P."""
    A, k, n, rcond, qd, P = p[0], p[1], p[2], get(w, p[4]), p[6], p[7]
    m, tall = min(k, n), max(k, n)
    rest = p[10] + n
    G = rest + k
    V, sigma = G + tall * m, G + tall * m + m * m
    room = sigma + m
    most = _decompose_task(w, A, k, n, G, V, sigma)
    total = most
    if not p[11]:
        _project_jacobian(w, A, k, n, P, room + n)
        total = most + _decompose_task(w, room + n, k, n, G, V, sigma)
    _remaining_rate(w, p, rest)
    left, height, right, width = (V, m, G, tall) if k < n else (G, tall, V, m)
    for s in range(m):  # A P = left right', one of them orthonormal
        along = 0.0 * most
        for i in range(k):
            along = along + get(w, left + height * s + i) * get(w, rest + i)
        size = get(w, sigma + s)
        significant = size > rcond * most
        _take_direction(w, right + width * s, along / (size * size), significant, n, room, qd, P)
    broken = ~(total * 0.0 == 0.0)
    _set_nan(w, qd, n, broken)
    _set_nan(w, P, n * n, broken)


@part
def _set_nan(w, x, n, broken):
    """Set n rows to NaN in the broken runs."""
    for i in range(n):
        put(w, x + i, where(broken, np.nan, get(w, x + i)))


@part
def _project_jacobian(w, A, k, n, P, out):
    """Compute out = A P, a task matrix restricted to the null space."""
    for i in range(k):
        for j in range(n):
            total = 0.0 * get(w, A)
            for c in range(n):
                total = total + get(w, A + n * i + c) * get(w, P + n * c + j)
            put(w, out + n * i + j, total)


@part
def _take_direction(w, direction, along, significant, n, free, qd, P):
    """Add `along` P direction to qd, and remove this direction from P, in the `significant` runs.

    The direction is in the range of P up to rounding. The second projection protects the tasks of
    higher priority even if the motion is large, near a conflict of tasks.
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
        put(w, qd + i, get(w, qd + i) + where(significant, here * along, 0.0))
        for j in range(n):
            less = where(significant, here * get(w, free + j) / square, 0.0)
            put(w, P + n * i + j, get(w, P + n * i + j) - less)


@kernel
def _decompose_task(w, A, k, n, G, V, sigma):
    """Decompose A, or A' if A is wide, into G V'. Return the largest singular value."""
    p, m = max(k, n), min(k, n)
    for j in range(m):
        for i in range(p):
            put(w, G + j * p + i, get(w, A + (j * n + i if k < n else i * n + j)))
    decompose_columns(w, G, p, m, V, sigma)
    return _greatest_or_nan(w, sigma, m)


@part
def _greatest_or_nan(w, x, n):
    """Return the largest of n numbers, or a number that is not finite if one of them is not."""
    total = 0.0 * get(w, x)
    for i in range(1, n):
        total = total + 0.0 * get(w, x + i)
    return greatest_row(w, x, n) + total
