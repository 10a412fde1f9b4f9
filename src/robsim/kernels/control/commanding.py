"""Stages from the features to the command: the Jacobian of a camera, L J, and least squares.

All matrices stand row by row: L[k, 6], a Jacobian J[6, n], and A = L J [k, n].
"""

from robsim.kernels.formulas.gain import adapted
from robsim.kernels.linear_algebra.solve import solve_block, solve_product_block
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import WIDTH, absolute, get, lane, put, sqrt, where
from robsim.kernels.machine.stage import stage


@part
def _cross(w, T, c, x, y, z):
    """Return the axis c of T, crossed with a vector."""
    a, b, e = get(w, T + c), get(w, T + 4 + c), get(w, T + 8 + c)
    return b * z - e * y, e * x - a * z, a * y - b * x


@part
def _into_axes(w, T, J, n, x, y, z):
    """Write a vector, in the axes of T, into a column of height n."""
    for r in range(3):
        along = get(w, T + r) * x + get(w, T + 4 + r) * y + get(w, T + 8 + r) * z
        put(w, J + n * r, along)


@stage
def jacobian(p, w, step):
    """Compute J of a camera against its target, in its axes: (bodies, ratio, T_w_c, J, n, moves).

    Of each move: its column, body, whether it turns, axis, ratio, sign; see
    `robsim.kernels.formulas.jacobian`. An axis a through o gives v = a x (p - o), omega = a; a
    slide along a gives v = a.
    """
    poses, ratios, C, J, n, moves = p[0], p[1], p[2], p[3], p[4], p[5]
    zero = 0.0 * get(w, ratios)
    vx, vy, vz, ox, oy, oz = zero, zero, zero, zero, zero, zero
    for m in range(moves):
        at = 6 + 6 * m
        column, T, axis = p[at], poses + 12 * p[at + 1], p[at + 3]
        ratio = p[at + 5] * get(w, ratios + p[at + 4])
        a, b, c = get(w, T + axis), get(w, T + 4 + axis), get(w, T + 8 + axis)
        if p[at + 2]:
            x, y, z = _cross(
                w, T, axis,
                get(w, C + 3) - get(w, T + 3),
                get(w, C + 7) - get(w, T + 7),
                get(w, C + 11) - get(w, T + 11),
            )  # fmt: skip
            vx, vy, vz = vx + ratio * x, vy + ratio * y, vz + ratio * z
            ox, oy, oz = ox + ratio * a, oy + ratio * b, oz + ratio * c
        else:
            vx, vy, vz = vx + ratio * a, vy + ratio * b, vz + ratio * c
        if m + 1 == moves or p[at + 6] != column:
            _into_axes(w, C, J + column, n, vx, vy, vz)
            _into_axes(w, C, J + column + 3 * n, n, ox, oy, oz)
            vx, vy, vz, ox, oy, oz = zero, zero, zero, zero, zero, zero


@part
def _six(w, first, apart):
    """Return six rows that stand apart."""
    return (
        get(w, first), get(w, first + apart), get(w, first + 2 * apart),
        get(w, first + 3 * apart), get(w, first + 4 * apart), get(w, first + 5 * apart),
    )  # fmt: skip


@part
def _summed(a, b):
    """Return the sum of six products."""
    total = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return total + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@stage
def product(p, w, step):
    """Compute A = L J: (L, k, J, n, A).

    Two rows of L at a time stay in registers; the last one of an odd number is its own neighbour.
    """
    L, k, J, n, A = p[0], p[1], p[2], p[3], p[4]
    for i in range(0, k, 2):
        j = min(i + 1, k - 1)
        one, two = _six(w, L + 6 * i, 1), _six(w, L + 6 * j, 1)
        for c in range(n):
            column = _six(w, J + c, n)
            put(w, A + n * i + c, _summed(one, column))
            put(w, A + n * j + c, _summed(two, column))


@stage
def difference(p, w, step):
    """Compute error = s - s_goal: (k, s, s_goal, error)."""
    for i in range(p[0]):
        put(w, p[3] + i, get(w, p[1] + i) - get(w, p[2] + i))


@stage
def commanded(p, w, step):
    """Compute qd = -gain x: (n, gain, x, qd)."""
    for i in range(p[0]):
        put(w, p[3] + i, -(get(w, p[1]) * get(w, p[2] + i)))


@stage
def copied(p, w, step):
    """Copy rows of a block to others: (n, from, to)."""
    for i in range(p[0]):
        put(w, p[2] + i, get(w, p[1] + i))


@stage
def transpose(p, w, step):
    """Compute x = A' y: (A, k, n, y, x)."""
    A, k, n, y, x = p[0], p[1], p[2], p[3], p[4]
    for j in range(n):
        total = get(w, A + j) * get(w, y)
        for i in range(1, k):
            total = total + get(w, A + n * i + j) * get(w, y + i)
        put(w, x + j, total)


@stage
def solve(p, w, step):
    """Compute x = A^+ y: (A, k, n, y, damping or -1, rcond, x, rank, J, scratch)."""
    rank = solve_block(w, p[0], p[1], p[2], p[3], p[4], get(w, p[5]), p[6], p[8], p[9])
    put(w, p[7], rank)


@stage
def solve_product(p, w, step):
    """Compute x = (L J)^+ y: (L, k, J, n, L J, y, rcond, x, rank, scratch)."""
    share = get(w, p[6])
    rank = solve_product_block(w, p[0], p[1], p[2], p[3], p[4], p[5], share, p[7], p[9])
    put(w, p[8], rank)


@stage
def in_units(p, w, step):
    """Compute B, the matrix A[n, m] in another unit of length: (A, n, m, unit, how, B).

    The first three rows are divided by it (how 0) or multiplied (2), or the first three columns
    multiplied (1).
    """
    A, n, m, unit, how, B = p[0], p[1], p[2], get(w, p[3]), p[4], p[5]
    for i in range(n):
        for j in range(m):
            x = get(w, A + i * m + j)
            if (how == 1 and j < 3) or (how == 2 and i < 3):
                x = x * unit
            elif how == 0 and i < 3:
                x = x / unit
            put(w, B + i * m + j, x)


@stage
def weigh(p, w, step):
    """Compute B, each row that of A[n, m] times its own weight: (A, n, m, weights, B)."""
    for i in range(p[1]):
        for j in range(p[2]):
            put(w, p[4] + i * p[2] + j, get(w, p[3] + i) * get(w, p[0] + i * p[2] + j))


@stage
def mean(p, w, step):
    """Replace rows by the mean of themselves and others: (n, rows, others)."""
    for i in range(p[0]):
        put(w, p[1] + i, 0.5 * (get(w, p[1] + i) + get(w, p[2] + i)))


@stage
def to_first(p, w, step):
    """Compute L of the first camera's twist, L A: (L, k, A, out), with V = A V_first."""
    L, k, A, out = p[0], p[1], p[2], p[3]
    for i in range(k):
        for j in range(6):
            total = 0.0 * get(w, L)
            for c in range(6):
                total = total + get(w, L + 6 * i + c) * get(w, A + 6 * c + j)
            put(w, out + 6 * i + j, total)


@stage
def adapt(p, w, step):
    """Compute the gain at the size of an error or a command: (n, x, numbers, largest, gain).

    The numbers are those at zero and at infinity and the slope; the size is the norm or, if
    `largest`, the largest |x|.
    """
    zero = 0.0 * get(w, p[2])
    square, most = zero, zero
    for i in range(p[0]):
        x = absolute(get(w, p[1] + i))
        square, most = square + x * x, where(x > most, x, most)
    size = most if p[3] else sqrt(square)
    for i in range(WIDTH):
        at = p[2] * WIDTH + i
        found = adapted(w[at], w[at + WIDTH], w[at + 2 * WIDTH], lane(size, i))
        w[p[4] * WIDTH + i] = found


@stage
def along(p, w, step):
    """Compute out = A x: (A, n, m, x, out)."""
    A, n, m = p[0], p[1], p[2]
    for i in range(n):
        total = 0.0 * get(w, A)
        for j in range(m):
            total = total + get(w, A + m * i + j) * get(w, p[3] + j)
        put(w, p[4] + i, total)


@stage
def summed(p, w, step):
    """Compute out = x + y: (n, x, y, out)."""
    for i in range(p[0]):
        put(w, p[3] + i, get(w, p[1] + i) + get(w, p[2] + i))


@stage
def ahead(p, w, step):
    """Compute out = x + factor y, or x + y / factor: (n, x, factor, y, whether divided, out)."""
    factor = get(w, p[2])
    for i in range(p[0]):
        y = get(w, p[3] + i)
        more = y / factor if p[4] else factor * y
        put(w, p[5] + i, get(w, p[1] + i) + more)


@stage
def estimate(p, w, step):
    """Estimate the drift of the error that the command does not explain.

    (k, error, error before, what was moved, drift, lag, dt): a first-order filter.
    """
    share = get(w, p[6]) / (get(w, p[5]) + get(w, p[6]))
    for i in range(p[0]):
        error, drift = get(w, p[1] + i), 0.0 * share
        if step > 0:
            drift = get(w, p[4] + i)
            change = (error - get(w, p[2] + i)) / get(w, p[6])
            drift = drift + share * (change - get(w, p[3] + i) - drift)
        put(w, p[2] + i, error)
        put(w, p[4] + i, drift)


@stage
def masked(p, w, step):
    """Compute out, A[n, m] with zeros in hidden rows: (A, n, m, hidden, out)."""
    for i in range(p[1]):
        for j in range(p[2]):
            at = i * p[2] + j
            put(w, p[4] + at, where(get(w, p[3] + i) > 0.0, 0.0, get(w, p[0] + at)))


@stage
def widened(p, w, step):
    """Copy A[n, m] into some columns of a wider matrix: (A, n, m, out, width), and the columns."""
    for i in range(p[1]):
        for j in range(p[2]):
            put(w, p[3] + i * p[4] + p[5 + j], get(w, p[0] + i * p[2] + j))


@stage
def either(p, w, step):
    """Compute whether any of some rows is true: (n, out), and the rows."""
    found = 0.0 * get(w, p[2])
    for i in range(p[0]):
        found = where(get(w, p[2 + i]) > 0.0, 1.0, found)
    put(w, p[1], found)


@stage
def cleared(p, w, step):
    """Set rows to zero: (n, first)."""
    for i in range(p[0]):
        put(w, p[1] + i, 0.0)


@stage
def taken(p, w, step):
    """Add velocities where it is their scheme's turn: (n, qd, second, which), and rows for each."""
    turn = get(w, p[2]) == 1.0 * p[3]
    for i in range(p[0]):
        put(w, p[4 + i], get(w, p[4 + i]) + where(turn, get(w, p[1] + i), 0.0))
