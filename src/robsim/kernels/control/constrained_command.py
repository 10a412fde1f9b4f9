"""The command nearest to the wish of a law that satisfies constraints.

The stage solves, for each run,

    minimise ||A (qd - wish)||^2 / a + eps ||qd - wish||^2,  low <= qd <= high,  C qd >= bound,

with a = trace(A'A)/n, by the method of `quadratic_program`. The bounds low <= high always hold. If
no command satisfies all rows, the rows of the highest level get a common slack s >= 0,

    C qd + |C| s >= bound,  with the additional cost price s^2,

and then the rows of lower levels too. |C| is the length of a row, so s is the largest distance of
the command from the half-space of a row. A command within the bounds always exists.
"""

import math

from robsim.kernels.control.quadratic_layout import (
    BOUND,
    HIGH,
    HIGH_PRICE,
    LOW,
    LOW_PRICE,
    METRIC,
    PRICE,
    SCALE,
    STEP,
    WISH,
    X,
    clear_quadratic_program,
    columns_at,
    count_blocks,
    count_quadratic_rows,
    matrices_at,
    row_vectors_at,
)
from robsim.kernels.control.quadratic_program import SOLVED, TOLERANCE, solve_quadratic_program
from robsim.kernels.machine.intrinsics import routine
from robsim.kernels.machine.lanes import WIDTH, absolute, any_lane, get, put, sqrt, where
from robsim.kernels.machine.stages import stage

# values of the row `unmet`: how the command was found
UNCHANGED, CONSTRAINED, RELAXED_VIEW, RELAXED_SPACE, RELAXED_ALL, UNSOLVED = range(6)
HIGHEST_LEVEL = 2  # level of the rows that get a slack first; level 0 is the last
NO_LEVEL = HIGHEST_LEVEL + 1


def count_constraint_rows(n: int, m: int) -> int:
    """Return the number of scratch rows that `constrain_command` needs."""
    return count_quadratic_rows(n + 1, m)


@stage
def constrain_command(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    eps="row",
    wish="n",
    low="n",
    high="n",
    C="m, n",
    m="count",
    bound="m",
    levels="m",
    price="row",
    qd="n",
    multipliers="2*n + m",
    slack="m",
    unmet="row",
    scratch="size",
    size="count",
):
    """Compute the command qd that is nearest to `wish` within bounds and rows.

    `multipliers` holds the multipliers of n lower bounds, n upper bounds and m rows of unit length.
    They are positive if a constraint keeps the command from the wish. A row with bound = -inf never
    acts.
    `slack` is the violation bound - C qd of each row that was relaxed. `unmet` is 0 if the wish
    satisfies all constraints and is returned bit for bit, 1 if another command satisfies them, and
    2, 3 or 4 if rows of level 2, 1 or 0 were relaxed. If a number of the wish or of a
    constraint is NaN, or the wish is infinite, the command is NaN and `unmet` is 5.
    """
    for i in range(n):
        put(w, qd + i, get(w, wish + i))
    for i in range(2 * n + m):
        put(w, multipliers + i, 0.0)
    for i in range(m):
        put(w, slack + i, 0.0)
    _test_wish(w, n, wish, low, high, C, m, bound, unmet)
    if any_lane(get(w, unmet) > 0.0):
        for b in range(WIDTH):
            if w[unmet * WIDTH + b] > 0.0:
                _constrain_run(
                    w, b, A, k, n, eps, wish, low, high, C, m, bound, levels, price, qd,
                    multipliers, slack, unmet, scratch,
                )  # fmt: skip


@routine
def _test_wish(w, n, wish, low, high, C, m, bound, unmet):
    """Set `unmet` to 0 in the runs whose wish satisfies all constraints, else to 1."""
    size = 0.0 * get(w, unmet)
    fits = size >= 0.0
    for i in range(n):
        x, least, largest = get(w, wish + i), get(w, low + i), get(w, high + i)
        fits = fits & (x >= least) & (x <= largest)
        least, largest, x = absolute(least), absolute(largest), absolute(x)
        most = where(least > largest, least, largest)
        x = where(x > most, most, x)
        size = where(x > size, x, size)
    for i in range(m):
        room, square = -get(w, bound + i), 0.0 * size
        for j in range(n):
            c = get(w, C + i * n + j)
            room = room + c * get(w, wish + j)
            square = square + c * c
        tolerance = TOLERANCE * (size * sqrt(square) + absolute(get(w, bound + i)))
        fits = fits & ((room >= 0.0) | (room + tolerance >= 0.0))
    put(w, unmet, where(fits, 0.0, 1.0))


@routine
def _constrain_run(
    w, b, A, k, n, eps, wish, low, high, C, m, bound, levels, price, qd, multipliers, slack,
    unmet, scratch,
):  # fmt: skip
    """Compute the command of the run in lane b."""
    if not _is_finite(w, b, n, wish, low, high, C, m, bound):
        for i in range(n):
            w[(qd + i) * WIDTH + b] = math.nan
        w[unmet * WIDTH + b] = UNSOLVED
        return
    code, level = UNSOLVED, NO_LEVEL
    while level >= 0:
        if level == NO_LEVEL or _has_level(w, b, m, levels, level):
            unknowns = n if level == NO_LEVEL else n + 1
            _write_program(
                w, b, A, k, n, eps, wish, low, high, C, m, bound, levels, price, scratch, level,
                unknowns,
            )  # fmt: skip
            if solve_quadratic_program(w, scratch, unknowns, m) == SOLVED:
                code = CONSTRAINED + NO_LEVEL - level
                _read_solution(w, b, n, m, unknowns, scratch, qd, multipliers)
                if level < NO_LEVEL:
                    _measure_slack(w, b, n, C, m, bound, levels, level, qd, slack)
                break
        level -= 1
    if code == UNSOLVED:
        for i in range(n):
            x = max(w[(wish + i) * WIDTH + b], w[(low + i) * WIDTH + b])
            w[(qd + i) * WIDTH + b] = min(x, w[(high + i) * WIDTH + b])
    w[unmet * WIDTH + b] = code


@routine
def _is_finite(w, b, n, wish, low, high, C, m, bound):
    """Return whether all numbers of a run are usable. Bounds may be infinite on their own side."""
    total = 0.0
    for i in range(n):
        total += 0.0 * w[(wish + i) * WIDTH + b]
        if not (w[(low + i) * WIDTH + b] < math.inf and w[(high + i) * WIDTH + b] > -math.inf):
            return False
    for i in range(m * n):
        total += 0.0 * w[(C + i) * WIDTH + b]
    for i in range(m):
        if not w[(bound + i) * WIDTH + b] < math.inf:
            return False
    return total == 0.0


@routine
def _has_level(w, b, m, levels, level):
    """Return whether a row has a level."""
    found = False
    for i in range(m):
        found |= w[(levels + i) * WIDTH + b] == level
    return found


@routine
def _write_program(
    w, b, A, k, n, eps, wish, low, high, C, m, bound, levels, price, scratch, level, unknowns
):
    """Write the quadratic program of a run. The rows from `level` on get a common slack."""
    clear_quadratic_program(w, scratch, unknowns, m)
    _write_metric(w, b, A, k, n, eps, scratch, unknowns)
    wide = count_blocks(unknowns) * WIDTH
    first = scratch * WIDTH
    own, least, largest = first + WISH * wide, first + LOW * wide, first + HIGH * wide
    for i in range(n):
        w[own + i] = w[(wish + i) * WIDTH + b]
        w[least + i] = w[(low + i) * WIDTH + b]
        w[largest + i] = w[(high + i) * WIDTH + b]
    if unknowns > n:
        w[least + n] = 0.0
        metric = matrices_at(scratch, unknowns) * WIDTH + (METRIC * unknowns + n) * wide
        w[metric + n] = w[price * WIDTH + b]
    _write_rows(w, b, n, C, m, bound, levels, scratch, level, unknowns)


@routine
def _write_rows(w, b, n, C, m, bound, levels, scratch, level, unknowns):
    """Write the rows of a program."""
    tall, columns = count_blocks(m) * WIDTH, columns_at(scratch, unknowns, m) * WIDTH
    bounds = row_vectors_at(scratch, unknowns) * WIDTH + BOUND * tall
    for i in range(m):
        w[bounds + i] = w[(bound + i) * WIDTH + b]
        square = 0.0
        for j in range(n):
            c = w[(C + i * n + j) * WIDTH + b]
            w[columns + j * tall + i] = c
            square += c * c
        if unknowns > n and w[(levels + i) * WIDTH + b] >= level:
            w[columns + n * tall + i] = math.sqrt(square) if square > 0.0 else 1.0


@routine
def _write_metric(w, b, A, k, n, eps, scratch, unknowns):
    """Write A'A n/trace(A'A) + eps I to the matrix of a program.

    If A is zero or not finite, I replaces the first term.
    """
    wide, row = count_blocks(unknowns), scratch + STEP * count_blocks(unknowns)
    H = matrices_at(scratch, unknowns) + METRIC * unknowns * wide
    for r in range(k):
        for j in range(n):
            w[row * WIDTH + j] = w[(A + r * n + j) * WIDTH + b]
        for i in range(n):
            for v in range(wide):
                product = w[row * WIDTH + i] * get(w, row + v)
                put(w, H + i * wide + v, get(w, H + i * wide + v) + product)
    trace = 0.0
    for i in range(n):
        trace += w[(H + i * wide) * WIDTH + i]
    is_usable = 0.0 < trace < math.inf
    for i in range(n):
        for v in range(wide):
            if is_usable:
                put(w, H + i * wide + v, n / trace * get(w, H + i * wide + v))
            else:
                put(w, H + i * wide + v, 0.0)
        w[(H + i * wide) * WIDTH + i] += w[eps * WIDTH + b] + (0.0 if is_usable else 1.0)


@routine
def _read_solution(w, b, n, m, unknowns, scratch, qd, multipliers):
    """Copy the command and the multipliers of a solved program to their rows.

    The multipliers of rows are those of rows of unit length, which are comparable.
    """
    wide, tall = count_blocks(unknowns) * WIDTH, count_blocks(m) * WIDTH
    x, lower, upper = scratch * WIDTH + X * wide, LOW_PRICE * wide, HIGH_PRICE * wide
    for i in range(n):
        w[(qd + i) * WIDTH + b] = w[x + i]
        w[(multipliers + i) * WIDTH + b] = w[scratch * WIDTH + lower + i]
        w[(multipliers + n + i) * WIDTH + b] = w[scratch * WIDTH + upper + i]
    vectors = row_vectors_at(scratch, unknowns) * WIDTH
    prices, scales = vectors + PRICE * tall, vectors + SCALE * tall
    for i in range(m):
        w[(multipliers + 2 * n + i) * WIDTH + b] = w[prices + i] / w[scales + i]


@routine
def _measure_slack(w, b, n, C, m, bound, levels, level, qd, slack):
    """Compute the violation of each relaxed row; 0 within the tolerance."""
    for i in range(m):
        room, size = -w[(bound + i) * WIDTH + b], abs(w[(bound + i) * WIDTH + b])
        for j in range(n):
            product = w[(C + i * n + j) * WIDTH + b] * w[(qd + j) * WIDTH + b]
            room += product
            size += abs(product)
        if w[(levels + i) * WIDTH + b] >= level and room < -TOLERANCE * size:
            w[(slack + i) * WIDTH + b] = -room
