"""The row space of a camera Jacobian: tasks of one camera in six coordinates.

The tasks of one camera have matrices A = L J with the same camera Jacobian J (6, n). Reflections H
factorise J' = H [R; 0] with a triangle R (6, 6) (Golub and Van Loan 2013, section 5.2). With
qd = H [x; z], A qd = L R' x: the six numbers x perform all tasks, and the motions z are free in all
of them. L R' has the singular values of A. H is applied as a product of reflections, which takes
12 n operations.
"""

from robsim.kernels.control.free_motions import project_motion
from robsim.kernels.linear_algebra.householder import (
    apply_reflections,
    apply_reflections_back,
    factorise_qr,
)
from robsim.kernels.linear_algebra.pseudoinverse import (
    apply_inverse_transpose,
    count_solution_rows,
    invert_triangle,
    solve_by_triangle,
    truncate_if_doubtful,
)
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import get, put, sqrt
from robsim.kernels.machine.stages import stage


@stage
def factorise_jacobian(w, step, J="6, n", n="count", V="6, n", betas="6", R="6, 6"):
    """Compute the reflections V, betas and the triangle R of J' = H [R; 0].

    R is stored in column-major order, and only its upper triangle is written.
    """
    for i in range(6 * n):  # the rows of J are the columns of J'
        put(w, V + i, get(w, J + i))
    factorise_qr(w, V, n, 6, betas, R)


@stage
def restrict_task(w, step, L="k, 6", k="count", R="6, 6", out="k, 6"):
    """Compute out = L R', the task matrix for the coordinates x of the row space."""
    multiply_triangle(w, L, k, R, out)


@part
def multiply_triangle(w, L, k, R, out):
    """Compute out = L R' for an upper triangle R."""
    for i in range(k):
        for j in range(6):
            total = get(w, L + 6 * i + j) * get(w, R + 7 * j)
            for c in range(j + 1, 6):
                total = total + get(w, L + 6 * i + c) * get(w, R + 6 * c + j)
            put(w, out + 6 * i + j, total)


@stage
def expand_motion(w, step, x="6", V="6, n", n="count", betas="6", qd="n"):
    """Compute qd = H [x; 0]."""
    _expand(w, x, V, n, betas, qd)


@kernel
def _expand(w, x, V, n, betas, qd):
    """Compute qd = H [x; 0]."""
    for i in range(n):
        put(w, qd + i, get(w, x + i) if i < 6 else 0.0 * get(w, x))
    apply_reflections_back(w, V, n, 6, betas, qd)


@stage
def solve_task_product(
    w,
    step,
    L="k, 6",
    k="count",
    J="6, n",
    n="count",
    A="k, n",
    y="k",
    V="6, n",
    betas="6",
    R="6, 6",
    rcond="row",
    x="n",
    rank="row",
    bound="row",
    scratch="size",
    size="count",
):
    """Compute x = A^+ y for A = L J with 6 < k, n, the rank of A, and a bound of its condition.

    If L and J have rank 6, (L J)^+ = J^+ L^+ (Greville 1966), although A is rank-deficient.
    Therefore no singular values are needed. The product of the bounds of L and J is a bound for A.
    """
    z, inverse, rest = scratch, scratch + 6, scratch + 6 + 36
    bound_L = solve_by_triangle(w, L, k, 6, y, -1, z, rest)
    put(w, bound, bound_L * _invert_jacobian_triangle(w, R, inverse))
    apply_inverse_transpose(w, inverse, 6, z)
    _expand(w, z, V, n, betas, x)
    found = truncate_if_doubtful(w, A, k, n, y, get(w, rcond), get(w, bound), 6, x, J, rest)
    put(w, rank, found)


def count_product_rows(k: int, n: int) -> int:
    """Return the number of scratch rows that `solve_task_product` needs."""
    return 6 + 36 + max(count_solution_rows(k, n), count_solution_rows(k, 6))


@part
def _invert_jacobian_triangle(w, R, inverse):
    """Compute R^-1 and return ||R|| ||R^-1||, in Frobenius norms."""
    invert_triangle(w, R, 6, inverse)
    norm, inverse_norm = 0.0 * get(w, R), 0.0 * get(w, R)
    for j in range(6):
        for i in range(j + 1):
            r, s = get(w, R + 6 * j + i), get(w, inverse + 6 * j + i)
            norm, inverse_norm = norm + r * r, inverse_norm + s * s
    return sqrt(norm) * sqrt(inverse_norm)


@part
def _project(w, V, n, betas, P, room, x):
    """Replace x by H [P x_0; x_1] with [x_0; x_1] = H' x. `room` has 6 rows."""
    apply_reflections(w, V, n, 6, betas, x, 1)
    for i in range(6):
        put(w, room + i, project_motion(w, 6, P, x, i))
    for i in range(6):
        put(w, x + i, get(w, room + i))
    apply_reflections_back(w, V, n, 6, betas, x)


@stage
def add_row_space_motion(
    w, step, motion="n", n="count", V="6, n", betas="6", P="6, 6", qd="n", out="n", scratch="6"
):
    """Add a secondary motion, projected onto the free motions, to the command qd.

    P is the projector for the coordinates x of the row space.
    """
    for i in range(n):
        put(w, out + i, get(w, motion + i))
    _project(w, V, n, betas, P, scratch, out)
    for i in range(n):
        put(w, out + i, get(w, qd + i) + get(w, out + i))


@stage
def expand_projector(w, step, P="6, 6", V="6, n", n="count", betas="6", out="n, n", scratch="6"):
    """Compute the projector for qd from the projector P for the coordinates x."""
    for j in range(n):
        for i in range(n):
            put(w, out + n * j + i, 1.0 if i == j else 0.0)
        _project(w, V, n, betas, P, scratch, out + n * j)
