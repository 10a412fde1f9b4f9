"""Small strictly convex quadratic programs by a dual active-set method.

The program is: minimise (x - wish)' H (x - wish) / 2 subject to low <= x <= high and C x >= b. The
method of Goldfarb and Idnani (Mathematical Programming 27, 1983, doi:10.1007/BF02591962) starts at
the unconstrained minimum x = wish. It adds violated constraints one by one, and removes constraints
with multipliers that would become negative. A wish that satisfies all constraints is therefore
returned unchanged, without a factorisation.

With H = L L' the columns of J = L^-T Q are orthonormal in the metric of H. The first q columns span
the gradients of the q active constraints. The matrix T maps the coordinates of a gradient in these
columns to a combination of the active gradients. Reflections update J and T: adding or removing a
constraint costs two products of vectors. J is stored by columns and by rows, so that all products
are sums of vectors.

Rows of C are scaled to unit length. Bounds are constraints with unit vectors and need no rows of C.
All arrays are consecutive rows of a block (see `robsim.kernels.machine.lanes`). A row holds WIDTH
consecutive numbers of one program.
"""

import math

from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import WIDTH, absolute, any_lane, get, put, sqrt, where

SOLVED, INFEASIBLE, ITERATION_LIMIT = 0, 1, 2
TOLERANCE = 1e-9  # violation of a scaled constraint, relative to the size of the command
INDEPENDENT = 1e-20  # least squared share of a gradient outside of the active gradients
ROUNDING = 1e-26  # rounding errors of this squared share, relative to the squared size of J
NEGLIGIBLE = 1e-11  # shares of active gradients that count as zero

# vectors of n numbers, in this order
WISH, LOW, HIGH, X, STEP, DUAL, SHARES, PRICES, ACTIVE, LOW_ROOM, HIGH_ROOM = range(11)
LOW_LIMIT, HIGH_LIMIT, LOW_PRICE, HIGH_PRICE, PLACES = range(11, 16)
VECTORS = 16
# matrices (n, n) after the vectors
METRIC, COLUMNS, ROWS, COMBINATIONS = range(4)
MATRICES = 4
# vectors of m numbers after the matrices, then the columns of C
BOUND, SCALE, ROOM, LIMIT, PRICE = range(5)
ROW_VECTORS = 5


def count_quadratic_rows(n: int, m: int) -> int:
    """Return the number of scratch rows that a program of n unknowns and m rows of C needs."""
    wide, tall = -(-n // WIDTH), -(-m // WIDTH)
    return (VECTORS + MATRICES * n) * wide + (ROW_VECTORS + n) * tall


@part
def count_blocks(n):
    """Return the number of block rows that hold n numbers."""
    return (n + WIDTH - 1) // WIDTH


@part
def vector_at(first, n, which):
    """Return the first row of a vector of n numbers."""
    return first + which * count_blocks(n)


@part
def matrix_at(first, n, which):
    """Return the first row of a matrix (n, n)."""
    return first + (VECTORS + which * n) * count_blocks(n)


@part
def row_vector_at(first, n, m, which):
    """Return the first row of a vector of m numbers."""
    return first + (VECTORS + MATRICES * n) * count_blocks(n) + which * count_blocks(m)


@part
def rows_at(first, n, m):
    """Return the first row of the columns of C, each of m numbers."""
    return row_vector_at(first, n, m, ROW_VECTORS)


@kernel
def clear_quadratic_program(w, first, n, m):
    """Set a program to zeros without constraints. The caller then writes its numbers.

    These are the vectors WISH, LOW and HIGH, the matrix METRIC, the vector BOUND and the columns
    of C.
    """
    for i in range(row_vector_at(first, n, m, 0) - first):
        put(w, first + i, 0.0)
    for v in range(count_blocks(n)):
        put(w, vector_at(first, n, LOW) + v, -math.inf)
        put(w, vector_at(first, n, HIGH) + v, math.inf)
    for v in range(count_blocks(m)):
        put(w, row_vector_at(first, n, m, BOUND) + v, -math.inf)
        for k in range(n):
            put(w, rows_at(first, n, m) + k * count_blocks(m) + v, 0.0)
    for i in range(WIDTH * count_blocks(n)):
        w[vector_at(first, n, PLACES) * WIDTH + i] = i


@kernel
def solve_quadratic_program(w, first, n, m):
    """Solve a program in place, and return SOLVED, INFEASIBLE or ITERATION_LIMIT.

    The vector X holds the solution. The vectors LOW_PRICE, HIGH_PRICE and PRICE hold the
    multipliers. For an infeasible program they hold a certificate y >= 0 instead: the same
    combination of the gradients vanishes, and the same combination of the bounds is positive
    (Farkas). It is 1, up to the scale of a row, at the constraint that cannot be met.
    """
    size = _scale_rows(w, first, n, m)
    for v in range(count_blocks(n)):
        put(w, vector_at(first, n, X) + v, get(w, vector_at(first, n, WISH) + v))
    _set_limits(w, first, n, m, size)
    _compute_rooms(w, first, n, m)
    worst = _find_worst(w, first, n, m)
    if worst < 0:
        _clip(w, first, n)
        return SOLVED
    spread = _factorise(w, first, n)
    q, exact = 0, False
    rounds = 10 * (n + m) + 100
    while worst >= 0:
        state, q, rounds = _add_constraint(w, first, n, m, worst, q, rounds, size, spread)
        if state != SOLVED:
            _clip(w, first, n)
            return state
        worst = _find_worst(w, first, n, m)
        if worst < 0:
            _clip(w, first, n)
            _compute_rooms(w, first, n, m)
            worst = _find_worst(w, first, n, m)
    _store_prices(w, first, n, m, q)
    return SOLVED


@part
def _scale_rows(w, first, n, m):
    """Scale rows of C to unit length. Return the size of a command within the box."""
    tall, columns = count_blocks(m), rows_at(first, n, m)
    bound, scale = row_vector_at(first, n, m, BOUND), row_vector_at(first, n, m, SCALE)
    for v in range(tall):
        total = 0.0 * get(w, columns + v)
        for k in range(n):
            total = total + get(w, columns + k * tall + v) * get(w, columns + k * tall + v)
        factor = 1.0 / sqrt(where(total > 0.0, total, 1.0))
        put(w, scale + v, factor)
        put(w, bound + v, get(w, bound + v) * factor)
        for k in range(n):
            put(w, columns + k * tall + v, get(w, columns + k * tall + v) * factor)
    size = 0.0
    wish, low, high = (vector_at(first, n, WISH), vector_at(first, n, LOW), vector_at(first, n, HIGH))
    for i in range(n):
        most = max(abs(w[low * WIDTH + i]), abs(w[high * WIDTH + i]))
        size = max(size, min(abs(w[wish * WIDTH + i]), most))
    return size


@part
def _set_limits(w, first, n, m, size):
    """Set the tolerance of each constraint, and all multipliers to zero."""
    for v in range(count_blocks(n)):
        put(w, vector_at(first, n, LOW_LIMIT) + v, TOLERANCE * size)
        put(w, vector_at(first, n, HIGH_LIMIT) + v, TOLERANCE * size)
        put(w, vector_at(first, n, LOW_PRICE) + v, 0.0)
        put(w, vector_at(first, n, HIGH_PRICE) + v, 0.0)
    for v in range(count_blocks(m)):
        b = absolute(get(w, row_vector_at(first, n, m, BOUND) + v))
        put(w, row_vector_at(first, n, m, LIMIT) + v, TOLERANCE * (size + b))
        put(w, row_vector_at(first, n, m, PRICE) + v, 0.0)


@part
def _compute_rooms(w, first, n, m):
    """Compute the distance of x from each constraint, negative for a violated constraint."""
    for v in range(count_blocks(n)):
        x = get(w, vector_at(first, n, X) + v)
        put(w, vector_at(first, n, LOW_ROOM) + v, x - get(w, vector_at(first, n, LOW) + v))
        put(w, vector_at(first, n, HIGH_ROOM) + v, get(w, vector_at(first, n, HIGH) + v) - x)
    tall, columns, x = count_blocks(m), rows_at(first, n, m), vector_at(first, n, X) * WIDTH
    for v in range(tall):
        total = -get(w, row_vector_at(first, n, m, BOUND) + v)
        for k in range(n):
            total = total + w[x + k] * get(w, columns + k * tall + v)
        put(w, row_vector_at(first, n, m, ROOM) + v, total)


@part
def _find_worst(w, first, n, m):
    """Return the most violated constraint that is not active, or -1.

    Constraints are numbered: n lower bounds, n upper bounds, m rows.
    """
    least, at = 0.0 * get(w, first), 0.0 * get(w, first) - 1.0
    for side in range(2):
        room, limit = vector_at(first, n, LOW_ROOM + side), vector_at(first, n, LOW_LIMIT + side)
        for v in range(count_blocks(n)):
            here = get(w, room + v) + get(w, limit + v)
            is_less = here < least
            least = where(is_less, here, least)
            at = where(is_less, get(w, vector_at(first, n, PLACES)) + (side * n + WIDTH * v), at)
    room, limit = row_vector_at(first, n, m, ROOM), row_vector_at(first, n, m, LIMIT)
    for v in range(count_blocks(m)):
        here = get(w, room + v) + get(w, limit + v)
        is_less = here < least
        least = where(is_less, here, least)
        at = where(is_less, get(w, vector_at(first, n, PLACES)) + (2 * n + WIDTH * v), at)
    if not any_lane(least < 0.0):
        return -1
    return _pick_least(w, vector_at(first, n, STEP), least, at)


@part
def _pick_least(w, room, values, numbers):
    """Return the number in the lane with the least value. `room` is a row for temporary values."""
    put(w, room, values)
    least, at = w[room * WIDTH], 0
    for i in range(1, WIDTH):
        if w[room * WIDTH + i] < least:
            least, at = w[room * WIDTH + i], i
    put(w, room, numbers)
    return int(w[room * WIDTH + at])


@part
def _factorise(w, first, n):
    """Compute J = L^-T for H = L L' by elimination. Return the squared size of J.

    The elimination of [H, I] gives [D L', L^-1] with unit diagonals of L, without square roots.
    """
    wide, H = count_blocks(n), matrix_at(first, n, METRIC)
    J, rows = matrix_at(first, n, COLUMNS), matrix_at(first, n, ROWS)
    places = vector_at(first, n, PLACES)
    for i in range(n):
        for v in range(wide):
            put(w, J + i * wide + v, where(get(w, places + v) == i, 1.0, 0.0 * get(w, places + v)))
    for j in range(n):
        inverse = 1.0 / w[(H + j * wide) * WIDTH + j]
        for i in range(j + 1, n):
            factor = w[(H + i * wide) * WIDTH + j] * inverse
            for v in range(wide):
                put(w, H + i * wide + v, get(w, H + i * wide + v) - factor * get(w, H + j * wide + v))
                put(w, J + i * wide + v, get(w, J + i * wide + v) - factor * get(w, J + j * wide + v))
    size = 0.0
    for i in range(n):
        factor = 1.0 / math.sqrt(w[(H + i * wide) * WIDTH + i])
        for v in range(wide):
            put(w, J + i * wide + v, get(w, J + i * wide + v) * factor)
        for j in range(n):
            x = w[(J + i * wide) * WIDTH + j]
            w[(rows + j * wide) * WIDTH + i] = x
            size += x * x
    return size


@part
def _add_constraint(w, first, n, m, p, q, rounds, size, spread):
    """Make constraint p active. Return the state, the number of active constraints, and rounds."""
    price = 0.0
    while True:
        rounds -= 1
        if rounds < 0:
            return ITERATION_LIMIT, q, rounds
        free, is_free = _project_gradient(w, first, n, m, p, q, spread)
        shorter, leaving = _find_leaving(w, first, n, q)
        room = _read_room(w, first, n, m, p)
        full = -room / free if is_free else math.inf
        step = min(shorter, full)
        if step == math.inf:
            _store_certificate(w, first, n, m, p, q)
            return INFEASIBLE, q, rounds
        price += step
        _move(w, first, n, m, step, is_free)
        if full <= shorter:
            _enter(w, first, n, m, p, q, price, free)
            return SOLVED, q + 1, rounds
        _leave(w, first, n, m, leaving, q, size)
        q -= 1


@part
def _project_gradient(w, first, n, m, p, q, spread):
    """Compute the coordinates of gradient p, the direction of x, and the shares of active gradients.

    Return the squared length of the part outside of the active gradients, and whether it is
    significant.
    """
    wide, dual = count_blocks(n), vector_at(first, n, DUAL)
    J, rows = matrix_at(first, n, COLUMNS), matrix_at(first, n, ROWS)
    T = matrix_at(first, n, COMBINATIONS)
    tall, columns = count_blocks(m), rows_at(first, n, m)
    for v in range(wide):
        if p < n:
            total = get(w, rows + p * wide + v)
        elif p < 2 * n:
            total = -get(w, rows + (p - n) * wide + v)
        else:
            total = 0.0 * get(w, rows + v)
            for k in range(n):
                c = w[(columns + k * tall) * WIDTH + p - 2 * n]
                total = total + c * get(w, rows + k * wide + v)
        put(w, dual + v, total)
    free, whole = 0.0, 0.0
    for k in range(q):
        whole += w[dual * WIDTH + k] * w[dual * WIDTH + k]
    for k in range(q, n):
        free += w[dual * WIDTH + k] * w[dual * WIDTH + k]
    for v in range(wide):
        total = 0.0 * get(w, J + v)
        for k in range(q, n):
            total = total + w[dual * WIDTH + k] * get(w, J + k * wide + v)
        put(w, vector_at(first, n, STEP) + v, total)
        total = 0.0 * get(w, J + v)
        for k in range(q):
            total = total + w[dual * WIDTH + k] * get(w, T + k * wide + v)
        put(w, vector_at(first, n, SHARES) + v, total)
    return free, free > INDEPENDENT * (free + whole) + ROUNDING * spread


@part
def _find_leaving(w, first, n, q):
    """Return the longest step without negative multipliers, and the place that limits it."""
    shares, prices = vector_at(first, n, SHARES) * WIDTH, vector_at(first, n, PRICES) * WIDTH
    least, at, most = math.inf, -1, 1.0
    for k in range(q):
        most = max(most, abs(w[shares + k]))
    for k in range(q):
        if w[shares + k] > NEGLIGIBLE * most and w[prices + k] / w[shares + k] < least:
            least, at = w[prices + k] / w[shares + k], k
    return least, at


@part
def _read_room(w, first, n, m, p):
    """Return the distance of x from constraint p."""
    if p < n:
        return w[vector_at(first, n, LOW_ROOM) * WIDTH + p]
    if p < 2 * n:
        return w[vector_at(first, n, HIGH_ROOM) * WIDTH + p - n]
    return w[row_vector_at(first, n, m, ROOM) * WIDTH + p - 2 * n]


@part
def _move(w, first, n, m, step, is_free):
    """Move the multipliers, and x with its distances if a direction is free."""
    step_rows, prices = vector_at(first, n, STEP), vector_at(first, n, PRICES)
    for v in range(count_blocks(n)):
        left = get(w, prices + v) - step * get(w, vector_at(first, n, SHARES) + v)
        put(w, prices + v, where(left > 0.0, left, 0.0))
    if not is_free:
        return
    for v in range(count_blocks(n)):
        move = step * get(w, step_rows + v)
        low, high = vector_at(first, n, LOW_ROOM) + v, vector_at(first, n, HIGH_ROOM) + v
        put(w, vector_at(first, n, X) + v, get(w, vector_at(first, n, X) + v) + move)
        put(w, low, get(w, low) + move)
        put(w, high, get(w, high) - move)
    tall, columns, room = count_blocks(m), rows_at(first, n, m), row_vector_at(first, n, m, ROOM)
    for v in range(tall):
        total = 0.0 * get(w, columns + v)
        for k in range(n):
            total = total + w[step_rows * WIDTH + k] * get(w, columns + k * tall + v)
        put(w, room + v, get(w, room + v) + step * total)


@part
def _set_limit(w, first, n, m, p, size, is_active):
    """Set the tolerance of constraint p. An active constraint counts as never violated."""
    if p < n:
        w[vector_at(first, n, LOW_LIMIT) * WIDTH + p] = math.inf if is_active else TOLERANCE * size
    elif p < 2 * n:
        w[vector_at(first, n, HIGH_LIMIT) * WIDTH + p - n] = (
            math.inf if is_active else TOLERANCE * size
        )
    else:
        b = abs(w[row_vector_at(first, n, m, BOUND) * WIDTH + p - 2 * n])
        w[row_vector_at(first, n, m, LIMIT) * WIDTH + p - 2 * n] = (
            math.inf if is_active else TOLERANCE * (size + b)
        )


@part
def _enter(w, first, n, m, p, q, price, free):
    """Add constraint p as active constraint q by a reflection of the free columns of J."""
    wide, dual, step = count_blocks(n), vector_at(first, n, DUAL), vector_at(first, n, STEP)
    J, T = matrix_at(first, n, COLUMNS), matrix_at(first, n, COMBINATIONS)
    length = math.copysign(math.sqrt(free), w[dual * WIDTH + q])
    factor = 1.0 / (free + length * w[dual * WIDTH + q])
    inverse = 1.0 / length
    for v in range(wide):
        place = get(w, vector_at(first, n, PLACES) + v)
        put(w, T + q * wide + v, where(place == q, -inverse, inverse * get(w, vector_at(first, n, SHARES) + v)))
        d = where(place < q, 0.0, get(w, dual + v))
        put(w, dual + v, where(place == q, d + length, d))
        put(w, step + v, factor * (get(w, step + v) + length * get(w, J + q * wide + v)))
    _reflect(w, first, n, q, n)
    w[vector_at(first, n, PRICES) * WIDTH + q] = price
    w[vector_at(first, n, ACTIVE) * WIDTH + q] = p
    _set_limit(w, first, n, m, p, 0.0, True)


@part
def _reflect(w, first, n, start, end):
    """Subtract y v' from J, with y in the vector STEP and v in the vector DUAL."""
    wide, dual, step = count_blocks(n), vector_at(first, n, DUAL), vector_at(first, n, STEP)
    J, rows = matrix_at(first, n, COLUMNS), matrix_at(first, n, ROWS)
    for v in range(wide):
        y, d = get(w, step + v), get(w, dual + v)
        for k in range(start, end):
            put(w, J + k * wide + v, get(w, J + k * wide + v) - w[dual * WIDTH + k] * y)
        for k in range(n):
            put(w, rows + k * wide + v, get(w, rows + k * wide + v) - w[step * WIDTH + k] * d)


@part
def _leave(w, first, n, m, leaving, q, size):
    """Remove an active constraint by a reflection of the active columns of J.

    The reflection maps row `leaving` of T to a multiple of the last active column. The last active
    constraint takes the free place.
    """
    wide, dual, step = count_blocks(n), vector_at(first, n, DUAL), vector_at(first, n, STEP)
    J, T, last = matrix_at(first, n, COLUMNS), matrix_at(first, n, COMBINATIONS), q - 1
    active, prices = vector_at(first, n, ACTIVE) * WIDTH, vector_at(first, n, PRICES) * WIDTH
    for v in range(wide):
        put(w, dual + v, 0.0)
    square = 0.0
    for k in range(q):
        t = w[(T + k * wide) * WIDTH + leaving]
        w[dual * WIDTH + k] = t
        square += t * t
    length = math.copysign(math.sqrt(square), w[dual * WIDTH + last])
    factor = 1.0 / (square + length * w[dual * WIDTH + last])
    w[dual * WIDTH + last] += length
    for v in range(wide):
        total, others = 0.0 * get(w, J + v), 0.0 * get(w, J + v)
        for k in range(q):
            total = total + w[dual * WIDTH + k] * get(w, J + k * wide + v)
            others = others + w[dual * WIDTH + k] * get(w, T + k * wide + v)
        put(w, step + v, factor * total)
        for k in range(last):
            put(w, T + k * wide + v, get(w, T + k * wide + v) - factor * w[dual * WIDTH + k] * others)
    _reflect(w, first, n, 0, q)
    for k in range(last):
        w[(T + k * wide) * WIDTH + leaving] = w[(T + k * wide) * WIDTH + last]
        w[(T + k * wide) * WIDTH + last] = 0.0
    _set_limit(w, first, n, m, int(w[active + leaving]), size, False)
    w[active + leaving], w[prices + leaving] = w[active + last], w[prices + last]
    w[prices + last] = 0.0


@part
def _clip(w, first, n):
    """Clip x to its bounds."""
    for v in range(count_blocks(n)):
        x = get(w, vector_at(first, n, X) + v)
        low, high = get(w, vector_at(first, n, LOW) + v), get(w, vector_at(first, n, HIGH) + v)
        x = where(x < low, low, x)
        put(w, vector_at(first, n, X) + v, where(x > high, high, x))


@part
def _store_price(w, first, n, m, p, price):
    """Store the multiplier of constraint p."""
    if p < n:
        w[vector_at(first, n, LOW_PRICE) * WIDTH + p] = price
    elif p < 2 * n:
        w[vector_at(first, n, HIGH_PRICE) * WIDTH + p - n] = price
    else:
        scale = w[row_vector_at(first, n, m, SCALE) * WIDTH + p - 2 * n]
        w[row_vector_at(first, n, m, PRICE) * WIDTH + p - 2 * n] = price * scale


@part
def _store_prices(w, first, n, m, q):
    """Store the multipliers of the active constraints."""
    active, prices = vector_at(first, n, ACTIVE) * WIDTH, vector_at(first, n, PRICES) * WIDTH
    for k in range(q):
        _store_price(w, first, n, m, int(w[active + k]), w[prices + k])


@part
def _store_certificate(w, first, n, m, p, q):
    """Store the combination of constraint p and the active constraints that excludes solutions."""
    active, shares = vector_at(first, n, ACTIVE) * WIDTH, vector_at(first, n, SHARES) * WIDTH
    for k in range(q):
        _store_price(w, first, n, m, int(w[active + k]), max(-w[shares + k], 0.0))
    _store_price(w, first, n, m, p, 1.0)
