"""Least squares x = A^+ y for many small systems, truncated or damped.

The default method is a QR factorisation by modified Gram-Schmidt, with the run innermost. It
computes R^-1 explicitly, and ||R|| ||R^-1|| (Frobenius) is an upper bound of the condition number.
If the bound of a run exceeds 1/rcond, the run uses its singular values, and singular values below
rcond * largest count as zero. Wide systems (more unknowns than equations) receive the least-norm
solution by the QR factorisation of A'. The columns of V are not normalised: Q = V D^-1/2. For four
image points and six joint velocities `unroll_kernel` generates straight-line code from the kernel.
"""

import numpy as np

from robsim.kernels.linear_algebra.register_columns import (
    HEIGHT,
    dot_columns,
    load_column,
    padded_height,
    put_difference,
)
from robsim.kernels.linear_algebra.svd import choose_length_unit, solve_truncated
from robsim.kernels.linear_algebra.svd import truncation_rows as truncated_rows
from robsim.kernels.machine.block_io import gather_rows, scatter_rows
from robsim.kernels.machine.intrinsics import routine, unroll_kernel
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, align_stack, any_lane, get, put, sqrt, where
from robsim.kernels.machine.linked_stages import link_stage
from robsim.kernels.machine.stages import stage

_DOUBTFUL_ROWS = 3  # rows of scratch that `truncate_doubtful` shares with its caller


@kernel
def multiply_matrices(A, B, out):
    """Compute out[i, j, b] = A[i, k, b] B[k, j, b]."""
    out[:] = 0.0
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            for k in range(A.shape[1]):
                for b in range(A.shape[2]):
                    out[i, j, b] += A[i, k, b] * B[k, j, b]


@routine
def _gram_schmidt(block, V, rows, n, count, R, inverse):
    """Orthogonalise n columns of V: V_before = V D^-1 R with the diagonal D of R and V'V.

    The further columns, `count` in all, become orthogonal to the first n columns. V (rows, count)
    and R (n, n) are stored in column-major order. D^-1 becomes the diagonal of `inverse`. Without
    normalisation no square root delays the next column.
    """
    for j in range(n):
        at = V + j * rows
        v = load_column(block, at)
        square = dot_columns(v, v)
        for i in range(HEIGHT, rows, HEIGHT):
            more = load_column(block, at + i)
            square = square + dot_columns(more, more)
        put(block, R + j * n + j, square)
        share = 1.0 / square
        put(block, inverse + j * n + j, share)
        for k in range(j + 1, count):
            put(block, R + k * n + j, _subtract_projection(block, at, v, share, V + k * rows, rows))


@part
def _subtract_projection(block, v, head, share, u, rows):
    """Subtract the projection onto v from u, and return v'u.

    `head` are the first rows of v, and share = 1/v'v.
    """
    top = load_column(block, u)
    along = dot_columns(head, top)
    for i in range(HEIGHT, rows, HEIGHT):
        along = along + dot_columns(load_column(block, v + i), load_column(block, u + i))
    factor = along * share
    put_difference(block, u, top, head, factor)
    for i in range(HEIGHT, rows, HEIGHT):
        put_difference(block, u + i, load_column(block, u + i), load_column(block, v + i), factor)
    return along


@part
def invert_triangle(block, R, n, inverse):
    """Compute inverse = R^-1 of an upper triangular R, both in column-major order."""
    for j in range(n):
        put(block, inverse + j * n + j, 1.0 / get(block, R + j * n + j))
    _invert_above_diagonal(block, R, n, inverse)


@routine
def _invert_above_diagonal(block, R, n, inverse):
    """Compute the rest of R^-1 from its diagonal."""
    for j in range(n):
        for i in range(j - 1, -1, -1):
            total = get(block, R + (i + 1) * n + i) * get(block, inverse + j * n + i + 1)
            for k in range(i + 2, j + 1):
                total = total + get(block, R + k * n + i) * get(block, inverse + j * n + k)
            put(block, inverse + j * n + i, -total * get(block, inverse + i * n + i))


@routine
def _condition_bound(block, R, inverse, n):
    """Return ||D^-1/2 R||_F ||R^-1 D^1/2||_F >= the condition number, D the diagonal of R.

    The factors are multiplied in an order that avoids overflow: r * (r * share) is at most the
    square of a length, but r * r might overflow.
    """
    norm, inverse_norm = 0.0 * get(block, R), 0.0 * get(block, R)
    for j in range(n):
        square, share = get(block, R + j * n + j), get(block, inverse + j * n + j)
        row, col = square, share  # the squares on the diagonals, as square * share = 1
        for k in range(j + 1, n):
            r = get(block, R + k * n + j)
            row = row + r * (r * share)
        for i in range(j):
            s = get(block, inverse + j * n + i)
            col = col + s * (s * square)
        norm, inverse_norm = norm + row, inverse_norm + col
    return sqrt(norm) * sqrt(inverse_norm)


@routine
def apply_inverse(block, inverse, n, y, x):
    """Compute x = R^-1 y from R^-1 in column-major order."""
    for i in range(n):
        total = get(block, inverse + i * n + i) * get(block, y + i)
        for j in range(i + 1, n):
            total = total + get(block, inverse + j * n + i) * get(block, y + j)
        put(block, x + i, total)


@routine
def apply_inverse_transpose(block, inverse, n, y):
    """Replace y by R^-T y, from R^-1 in column-major order."""
    for j in range(n - 1, -1, -1):
        total = get(block, inverse + j * n) * get(block, y)
        for i in range(1, j + 1):
            total = total + get(block, inverse + j * n + i) * get(block, y + i)
        put(block, y + j, total)


@routine
def _solve_wide(block, V, rows, n, inverse, y, x, count):
    """Compute the first `count` rows of x = V R^-T y; y[n] is replaced by R^-T y."""
    apply_inverse_transpose(block, inverse, n, y)
    for i in range(count):
        total = get(block, V + i) * get(block, y)
        for j in range(1, n):
            total = total + get(block, V + j * rows + i) * get(block, y + j)
        put(block, x + i, total)


def count_solution_rows(k: int, n: int) -> int:
    """Return the number of scratch rows that `solve_block` needs."""
    m, p = min(k, n), max(k, n)
    by_triangle = 1 + (p + m + HEIGHT - 1 + m) * (m + 1) + m * m
    return max(by_triangle, _DOUBTFUL_ROWS + 1 + p * m + m * m + m + 2 * n)


solution_rows = part(count_solution_rows)


@part
def _factorise_and_solve(numbers, block):
    """Compute x = A^+ y and a bound of the condition number of A.

    The numbers are (A, k, n, y, damping or -1, x, scratch, bound).
    """
    A, k, n, y, damping, x = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]
    wide, m, p = k < n, min(k, n), max(k, n)
    rows = padded_height(p + m if damping >= 0 else p)
    V = numbers[6]
    right_side = V + m * rows
    R = right_side + rows
    along, inverse = R + m * m, R + m * m + m
    for j in range(m):
        _load_padded_column(
            block, V + j * rows, rows, A + (j * n if wide else j), 1 if wide else n, p
        )
        if damping >= 0:
            put(block, V + j * rows + p + j, get(block, damping))
    _load_padded_column(block, right_side, rows, y, 1, k)
    _gram_schmidt(block, V, rows, m, m if wide else m + 1, R, inverse)
    _invert_above_diagonal(block, R, m, inverse)
    put(block, numbers[7], _condition_bound(block, R, inverse, m))
    if wide:
        _solve_wide(block, V, rows, m, inverse, right_side, x, p)
    else:
        # V'y was computed column by column, which keeps Gram-Schmidt stable
        apply_inverse(block, inverse, m, along, x)


@part
def _load_padded_column(block, at, rows, first, stride, count):
    """Copy `count` rows at a stride `stride` to a column, and fill the column with zeros."""
    for i in range(count):
        put(block, at + i, get(block, first + i * stride))
    for i in range(count, rows):
        put(block, at + i, 0.0)


_solve_four_points = unroll_kernel(_factorise_and_solve, (0, 3, 5, 7), {1: 8, 2: 6, 4: -1, 6: 0})


@stage
def by_triangle(numbers, block, step):
    """Compute x = A^+ y by a QR factorisation, and a bound of the condition number of A.

    The numbers are (A, k, n, y, damping or -1, x, scratch, bound), and bound is a row.
    """
    align_stack()
    _factorise_and_solve(numbers, block)


@stage
def by_triangle_of_four_points(numbers, block, step):
    """Perform `by_triangle` for k = 8 and n = 6 without damping."""
    align_stack()
    _solve_four_points(numbers, block)


_linked_by_triangle = link_stage(by_triangle)
_linked_four_points = link_stage(by_triangle_of_four_points)


@part
def solve_by_triangle(block, A, k, n, y, damping, x, scratch):
    """Compute x = A^+ y by a QR factorisation, and return a bound of the condition number of A.

    `damping` is a row, or -1 for none.
    """
    numbers = (A, k, n, y, damping, x, scratch + 1, scratch)
    if k == 8 and n == 6 and damping < 0:
        _linked_four_points(block, numbers)
    else:
        _linked_by_triangle(block, numbers)
    return get(block, scratch)


@stage
def truncate_doubtful(numbers, block, step):
    """Replace x of the doubtful runs by the truncated solution, and the full rank by the rank.

    The numbers are (A, k, n, y, x, J, scratch). The first rows of `scratch` are the full rank,
    rcond, and 1 for a doubtful run or 0. The rank is the larger rank of two units of length, as a
    bad unit may make a matrix nearly singular (see `robsim.kernels.linear_algebra.svd.truncate`). x
    is NaN if A is not finite.
    """
    A, k, n, y, x, J = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5]
    first, scratch = numbers[6], numbers[6] + _DOUBTFUL_ROWS
    full, rcond, doubtful = get(block, first), get(block, first + 1), get(block, first + 2) > 0.0
    solution = scratch + truncated_rows(k, n)
    rank = solve_truncated(block, A, k, n, y, rcond, solution, -1, scratch)
    deficient = doubtful & (rank < full)
    if J != -1 and any_lane(deficient & ~(choose_length_unit(block, A, k, n, J) == 1.0)):
        scaled_solution = solution + n
        scaled_rank = solve_truncated(block, A, k, n, y, rcond, scaled_solution, J, scratch)
        for i in range(n):
            entry, scaled_entry = get(block, solution + i), get(block, scaled_solution + i)
            put(block, solution + i, where(scaled_rank > rank, scaled_entry, entry))
        rank = where(scaled_rank > rank, scaled_rank, rank)
    total = 0.0 * get(block, A)
    for i in range(1, k * n):
        total = total + 0.0 * get(block, A + i)
    for i in range(n):
        put(block, x + i, where(doubtful, get(block, solution + i) + total, get(block, x + i)))
    put(block, first, where(doubtful & (total == 0.0), rank, full))


_linked_truncate_doubtful = link_stage(truncate_doubtful)


@part
def truncate_if_doubtful(block, A, k, n, y, rcond, bound, full, x, J, scratch):
    """Replace x of the runs with a large bound by the truncated solution, and return the rank.

    `bound` is a bound of the condition number of A, and `full` its full rank.
    """
    doubtful = ~(bound * rcond < 1.0)
    rank = 0.0 * rcond + full
    if any_lane(doubtful):
        put(block, scratch, rank)
        put(block, scratch + 1, rcond)
        put(block, scratch + 2, where(doubtful, 1.0, 0.0))
        _linked_truncate_doubtful(block, (A, k, n, y, x, J, scratch))
        rank = get(block, scratch)
    return rank


@part
def solve_block(block, A, k, n, y, damping, rcond, x, J, scratch):
    """Compute x = argmin ||A x - y||^2 + damping^2 ||x||^2 for A[k, n], and return the rank of A.

    A is stored in row-major order. `damping` is a row, or -1 for none. Without damping, singular
    values below rcond * largest are truncated, in the unit of length with the larger rank. J
    determines the columns per metre (see `robsim.kernels.linear_algebra.svd.is_per_metre`). With
    damping, the returned rank is the full rank.
    """
    bound = solve_by_triangle(block, A, k, n, y, damping, x, scratch)
    if damping >= 0:
        return 0.0 * rcond + min(k, n)
    return truncate_if_doubtful(block, A, k, n, y, rcond, bound, min(k, n), x, J, scratch)


@kernel
def least_squares(A, y, damping, rcond, x, rank):
    """Compute x[n, b] = argmin ||A x - y||^2 + damping^2 ||x||^2, and rank[b] of A[m, n, b].

    With damping 0, singular values below rcond * largest are truncated. With damping, the returned
    rank is the full rank.
    """
    k, n, runs = A.shape
    first_y = k * n
    first_x = first_y + k
    first = first_x + n  # rows of damping, rcond and rank
    scratch = first + 3
    block = np.zeros((scratch + solution_rows(k, n)) * WIDTH)
    put(block, first, damping)
    put(block, first + 1, rcond)
    for b in range(0, runs, WIDTH):
        _gather_matrix(A, b, 0, block)
        gather_rows(y, b, first_y, block)
        damped = first if damping > 0.0 else -1
        share = get(block, first + 1)
        lanes = solve_block(block, 0, k, n, first_y, damped, share, first_x, -1, scratch)
        put(block, first + 2, lanes)
        scatter_rows(block, first_x, b, x)
        for lane in range(min(WIDTH, runs - b)):
            rank[b + lane] = int(block[(first + 2) * WIDTH + lane])


@kernel
def _gather_matrix(A, b, row, block):
    """Copy A[:, :, b:] to rows of a block in row-major order."""
    for i in range(A.shape[0]):
        gather_rows(A[i], b, row + i * A.shape[1], block)
