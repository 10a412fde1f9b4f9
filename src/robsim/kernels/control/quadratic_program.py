"""Small strictly convex quadratic programs by a dual active-set method.

The program is: minimise (x - wish)' H (x - wish) / 2 subject to low <= x <= high and C x >= b. The
method of Goldfarb and Idnani (Mathematical Programming 27, 1983, doi:10.1007/BF02591962) starts at
the unconstrained minimum x = wish. It adds violated constraints one by one, and removes active
constraints with multipliers that would become negative. A wish that satisfies all constraints is
therefore returned unchanged, without a factorisation.

Constraints are numbered: n lower bounds, n upper bounds, m rows. Bounds are constraints with unit
gradients and need no rows of C. Rows of C are scaled to unit length. A row that was zero never acts
if its bound is negative; otherwise it excludes all solutions.
"""

import math

from robsim.kernels.control.active_constraints import (
    add_active,
    factorise_metric,
    project_gradient,
    remove_active,
)
from robsim.kernels.control.quadratic_layout import (
    ACTIVE,
    BOUND,
    HIGH,
    HIGH_LIMIT,
    HIGH_PRICE,
    HIGH_ROOM,
    LIMIT,
    LOW,
    LOW_LIMIT,
    LOW_PRICE,
    LOW_ROOM,
    METRIC,
    PLACES,
    PRICE,
    PRICES,
    ROOM,
    SCALE,
    SHARES,
    STEP,
    WISH,
    X,
    clear_quadratic_program,
    columns_at,
    count_blocks,
    matrices_at,
    row_vectors_at,
)
from robsim.kernels.machine.array_views import pointer_of
from robsim.kernels.machine.intrinsics import routine
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import (
    WIDTH,
    absolute,
    get,
    get_lane,
    least_lane,
    put,
    sqrt,
    where,
)

SOLVED, INFEASIBLE, ITERATION_LIMIT = 0, 1, 2
TOLERANCE = 1e-9  # violation of a scaled constraint, relative to the size of the command
NEGLIGIBLE = 1e-11  # share of an active gradient that counts as zero


@routine
def solve_quadratic_program(w, first, n, m):
    """Solve a program in place, and return SOLVED, INFEASIBLE or ITERATION_LIMIT.

    The vector X holds the solution, within its bounds. The vectors LOW_PRICE, HIGH_PRICE and PRICE
    hold the multipliers. For an infeasible program they hold a certificate y >= 0 instead: this
    combination of the gradients vanishes, and the same combination of the bounds is positive
    (Farkas). The certificate is positive at the constraint that cannot be met and at the active
    constraints that exclude it.
    """
    size, wide = _scale_rows(w, first, n, m), count_blocks(n)
    for v in range(wide):
        put(w, first + X * wide + v, get(w, first + WISH * wide + v))
    _set_limits(w, first, n, m, size)
    _compute_rooms(w, first, n, m)
    worst = _find_worst(w, first, n, m)
    state, q, rounds = SOLVED, 0, 10 * (n + m) + 100
    spread = factorise_metric(w, first, n) if worst >= 0 else 0.0
    while worst >= 0 and state == SOLVED:
        state, q, rounds = _meet_constraint(w, first, n, m, worst, q, rounds, size, spread)
        worst = _find_worst(w, first, n, m)
        if worst < 0:  # without the rounding errors of many steps
            _clip_solution(w, first, n)
            _compute_rooms(w, first, n, m)
            worst = _find_worst(w, first, n, m)
    _clip_solution(w, first, n)
    if state == SOLVED:
        for k in range(q):
            p = int(w[(first + ACTIVE * wide) * WIDTH + k])
            _store_price(w, first, n, m, p, w[(first + PRICES * wide) * WIDTH + k])
    return state


@kernel
def solve_arrays(H, wish, box, C, bound, solution, scratch):
    """Solve the program of arrays, and return SOLVED, INFEASIBLE or ITERATION_LIMIT.

    `box` (2, n) holds low and high. `solution` (3 n + m,) receives x, and then the multipliers or
    the certificate. `scratch` has WIDTH numbers for each of `count_quadratic_rows(n, m)` rows.
    """
    w, n, m = pointer_of(scratch), wish.size, bound.size
    _write_arrays(w, H, wish, box, C, bound)
    state = solve_quadratic_program(w, 0, n, m)
    wide, prices = count_blocks(n), (row_vectors_at(0, n) + PRICE * count_blocks(m)) * WIDTH
    for i in range(n):
        solution[i] = w[X * wide * WIDTH + i]
        solution[n + i] = w[LOW_PRICE * wide * WIDTH + i]
        solution[2 * n + i] = w[HIGH_PRICE * wide * WIDTH + i]
    for i in range(m):
        solution[3 * n + i] = w[prices + i]
    return state


@part
def _write_arrays(w, H, wish, box, C, bound):
    """Write the program of arrays to memory."""
    n, m = wish.size, bound.size
    clear_quadratic_program(w, 0, n, m)
    wide, tall, metric = count_blocks(n), count_blocks(m), matrices_at(0, n)
    for i in range(n):
        w[WISH * wide * WIDTH + i] = wish[i]
        w[LOW * wide * WIDTH + i] = box[0, i]
        w[HIGH * wide * WIDTH + i] = box[1, i]
        for j in range(n):
            w[(metric + (METRIC * n + i) * wide) * WIDTH + j] = H[i, j]
    bounds, columns = (row_vectors_at(0, n) + BOUND * tall) * WIDTH, columns_at(0, n, m) * WIDTH
    for i in range(m):
        w[bounds + i] = bound[i]
        for k in range(n):
            w[columns + k * tall * WIDTH + i] = C[i, k]


@routine
def _scale_rows(w, first, n, m):
    """Scale rows of C to unit length. Return the size of a command within the bounds."""
    wide, tall, columns = count_blocks(n), count_blocks(m), columns_at(first, n, m)
    bound = row_vectors_at(first, n) + BOUND * tall
    scale = row_vectors_at(first, n) + SCALE * tall
    for v in range(tall):
        total = 0.0 * get(w, columns + v)
        for k in range(columns + v, columns + v + n * tall, tall):
            total = total + get(w, k) * get(w, k)
        factor = 1.0 / sqrt(where(total > 0.0, total, 1.0))
        put(w, scale + v, factor)
        put(w, bound + v, get(w, bound + v) * factor)
        for k in range(columns + v, columns + v + n * tall, tall):
            put(w, k, get(w, k) * factor)
    size = 0.0
    for i in range(n):
        low, high = w[(first + LOW * wide) * WIDTH + i], w[(first + HIGH * wide) * WIDTH + i]
        size = max(size, min(abs(w[(first + WISH * wide) * WIDTH + i]), max(abs(low), abs(high))))
    return size


@routine
def _set_limits(w, first, n, m, size):
    """Set the tolerance of each constraint."""
    wide, tall, tail = count_blocks(n), count_blocks(m), row_vectors_at(first, n)
    for v in range(wide):
        put(w, first + LOW_LIMIT * wide + v, TOLERANCE * size)
        put(w, first + HIGH_LIMIT * wide + v, TOLERANCE * size)
    for v in range(tall):
        bound = absolute(get(w, tail + BOUND * tall + v))
        put(w, tail + LIMIT * tall + v, TOLERANCE * (size + bound))


@routine
def _compute_rooms(w, first, n, m):
    """Compute the distance of x from each constraint, negative for a violated constraint."""
    wide, tall, tail = count_blocks(n), count_blocks(m), row_vectors_at(first, n)
    for v in range(wide):
        x = get(w, first + X * wide + v)
        put(w, first + LOW_ROOM * wide + v, x - get(w, first + LOW * wide + v))
        put(w, first + HIGH_ROOM * wide + v, get(w, first + HIGH * wide + v) - x)
    columns, x_at = columns_at(first, n, m), (first + X * wide) * WIDTH
    for v in range(tall):
        total = -get(w, tail + BOUND * tall + v)
        for k in range(n):
            total = total + w[x_at + k] * get(w, columns + k * tall + v)
        put(w, tail + ROOM * tall + v, total)


@routine
def _find_worst(w, first, n, m):
    """Return the most violated constraint that is not active, or -1."""
    wide, tall, tail = count_blocks(n), count_blocks(m), row_vectors_at(first, n)
    places, least = get(w, first + PLACES * wide), 0.0 * get(w, first)
    at = least - 1.0
    for v in range(2 * wide):  # lower bounds, upper bounds
        here = get(w, first + LOW_ROOM * wide + v) + get(w, first + LOW_LIMIT * wide + v)
        first_number = WIDTH * v if v < wide else n + WIDTH * (v - wide)
        at = where(here < least, places + first_number, at)
        least = where(here < least, here, least)
    for v in range(tall):
        here = get(w, tail + ROOM * tall + v) + get(w, tail + LIMIT * tall + v)
        at = where(here < least, places + (2 * n + WIDTH * v), at)
        least = where(here < least, here, least)
    return int(get_lane(at, least_lane(least)))


@part
def _meet_constraint(w, first, n, m, p, q, rounds, size, spread):
    """Make constraint p active. Return the state, the number of active constraints, and rounds."""
    price, room = 0.0, _read_room(w, first, n, m, p)
    while rounds > 0:
        rounds -= 1
        free = project_gradient(w, first, n, m, p, q, spread)
        shorter, leaving = _find_leaving(w, first, n)
        full = -room / free if free > 0.0 else math.inf
        step = min(shorter, full)
        if not step < math.inf:
            _store_certificate(w, first, n, m, p, q)
            return INFEASIBLE, q, rounds
        price += step
        room += step * free
        _move_solution(w, first, n, m, step, free > 0.0)
        if full <= shorter:
            add_active(w, first, n, p, q, price, free)
            _set_limit(w, first, n, m, p, math.inf)
            return SOLVED, q + 1, rounds
        left = int(w[(first + ACTIVE * count_blocks(n)) * WIDTH + leaving])
        _set_limit(w, first, n, m, left, TOLERANCE * size)
        remove_active(w, first, n, leaving, q)
        q -= 1
    return ITERATION_LIMIT, q, rounds


@routine
def _find_leaving(w, first, n):
    """Return the longest step without negative multipliers, and the place that limits it."""
    wide, most, least, at = count_blocks(n), 1.0, math.inf, -1
    for v in range(wide):
        size = absolute(get(w, first + SHARES * wide + v))
        most = max(most, get_lane(size, least_lane(-size)))
    for v in range(wide):
        share = get(w, first + SHARES * wide + v)
        longest = get(w, first + PRICES * wide + v) / share
        longest = where(share > NEGLIGIBLE * most, longest, math.inf)
        lane = least_lane(longest)
        if get_lane(longest, lane) < least:
            least, at = get_lane(longest, lane), WIDTH * v + lane
    return least, at


@part
def _read_room(w, first, n, m, p):
    """Return the distance of x from constraint p."""
    wide = count_blocks(n)
    if p < n:
        return w[(first + LOW_ROOM * wide) * WIDTH + p]
    if p < 2 * n:
        return w[(first + HIGH_ROOM * wide) * WIDTH + p - n]
    return w[(row_vectors_at(first, n) + ROOM * count_blocks(m)) * WIDTH + p - 2 * n]


@routine
def _move_solution(w, first, n, m, step, is_free):
    """Move the multipliers, and x with its distances if a direction is free."""
    wide, tall = count_blocks(n), count_blocks(m)
    for v in range(first + PRICES * wide, first + PRICES * wide + wide):
        left = get(w, v) - step * get(w, v + (SHARES - PRICES) * wide)
        put(w, v, where(left > 0.0, left, 0.0))
    if not is_free:
        return
    for v in range(first, first + wide):
        move = step * get(w, v + STEP * wide)
        put(w, v + X * wide, get(w, v + X * wide) + move)
        put(w, v + LOW_ROOM * wide, get(w, v + LOW_ROOM * wide) + move)
        put(w, v + HIGH_ROOM * wide, get(w, v + HIGH_ROOM * wide) - move)
    columns, room = columns_at(first, n, m), row_vectors_at(first, n) + ROOM * tall
    for v in range(tall):
        total = 0.0 * get(w, columns + v)
        for k in range(n):
            along = w[(first + STEP * wide) * WIDTH + k]
            total = total + along * get(w, columns + k * tall + v)
        put(w, room + v, get(w, room + v) + step * total)


@routine
def _set_limit(w, first, n, m, p, limit):
    """Set the tolerance of constraint p; infinity for an active constraint, which stays met."""
    wide, tall, tail = count_blocks(n), count_blocks(m), row_vectors_at(first, n)
    if p < n:
        w[(first + LOW_LIMIT * wide) * WIDTH + p] = limit
    elif p < 2 * n:
        w[(first + HIGH_LIMIT * wide) * WIDTH + p - n] = limit
    else:
        bound = abs(w[(tail + BOUND * tall) * WIDTH + p - 2 * n])
        w[(tail + LIMIT * tall) * WIDTH + p - 2 * n] = limit + TOLERANCE * bound


@routine
def _clip_solution(w, first, n):
    """Clip x to its bounds."""
    wide = count_blocks(n)
    for v in range(first, first + wide):
        x, low, high = get(w, v + X * wide), get(w, v + LOW * wide), get(w, v + HIGH * wide)
        x = where(x < low, low, x)
        put(w, v + X * wide, where(x > high, high, x))


@routine
def _store_price(w, first, n, m, p, price):
    """Store the multiplier of constraint p."""
    wide, tall, tail = count_blocks(n), count_blocks(m), row_vectors_at(first, n)
    if p < n:
        w[(first + LOW_PRICE * wide) * WIDTH + p] = price
    elif p < 2 * n:
        w[(first + HIGH_PRICE * wide) * WIDTH + p - n] = price
    else:
        scale = w[(tail + SCALE * tall) * WIDTH + p - 2 * n]
        w[(tail + PRICE * tall) * WIDTH + p - 2 * n] = price * scale


@routine
def _store_certificate(w, first, n, m, p, q):
    """Store the combination of constraint p and the active constraints that excludes solutions."""
    wide = count_blocks(n)
    for k in range(q):
        share = w[(first + SHARES * wide) * WIDTH + k]
        active = int(w[(first + ACTIVE * wide) * WIDTH + k])
        _store_price(w, first, n, m, active, max(-share, 0.0))
    _store_price(w, first, n, m, p, 1.0)
