"""Stages from the features to the command: the Jacobian of a camera, L J, and least squares.

All matrices stand row by row: L[k, 6], a Jacobian J[6, n], and A = L J [k, n].
"""

from robsim.kernels.formulas.adaptive_gain import gain_at
from robsim.kernels.linear_algebra.pseudoinverse import solve_block, solve_product_block
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import WIDTH, absolute, get, get_lane, put, sqrt, where
from robsim.kernels.machine.stages import stage


@part
def _cross_axis(w, T, c, x, y, z):
    """Return the axis c of T, crossed with a vector."""
    a, b, e = get(w, T + c), get(w, T + 4 + c), get(w, T + 8 + c)
    return b * z - e * y, e * x - a * z, a * y - b * x


@part
def _write_in_axes(w, T, J, n, x, y, z):
    """Write a vector, in the axes of T, into a column of height n."""
    for r in range(3):
        along = get(w, T + r) * x + get(w, T + 4 + r) * y + get(w, T + 8 + r) * z
        put(w, J + n * r, along)


@stage
def compute_camera_jacobian(
    w,
    step,
    poses="bodies, 3, 4",
    ratios="r",
    T_w_c="3, 4",
    J="6, n",
    n="count",
    moves="each: column=whole; body=whole; turns=whole; axis=whole; ratio=whole; sign=whole",
    bodies="count",
    r="count",
):
    """Compute J of a camera against its target, in its axes: (bodies, ratio, T_w_c, J, n, moves).

    Of each move: its column, body, whether it turns, axis, ratio, sign; see
    `robsim.kernels.formulas.jacobian`. An axis a through o gives v = a x (p - o), omega = a; a
    slide along a gives v = a.
    """
    C = T_w_c
    zero = 0.0 * get(w, ratios)
    vx, vy, vz, ox, oy, oz = zero, zero, zero, zero, zero, zero
    for m in range(moves[0]):
        at = 1 + 6 * m
        column, T, axis = moves[at], poses + 12 * moves[at + 1], moves[at + 3]
        ratio = moves[at + 5] * get(w, ratios + moves[at + 4])
        a, b, c = get(w, T + axis), get(w, T + 4 + axis), get(w, T + 8 + axis)
        if moves[at + 2]:
            x, y, z = _cross_axis(
                w, T, axis,
                get(w, C + 3) - get(w, T + 3),
                get(w, C + 7) - get(w, T + 7),
                get(w, C + 11) - get(w, T + 11),
            )  # fmt: skip
            vx, vy, vz = vx + ratio * x, vy + ratio * y, vz + ratio * z
            ox, oy, oz = ox + ratio * a, oy + ratio * b, oz + ratio * c
        else:
            vx, vy, vz = vx + ratio * a, vy + ratio * b, vz + ratio * c
        if m + 1 == moves[0] or moves[at + 6] != column:
            _write_in_axes(w, C, J + column, n, vx, vy, vz)
            _write_in_axes(w, C, J + column + 3 * n, n, ox, oy, oz)
            vx, vy, vz, ox, oy, oz = zero, zero, zero, zero, zero, zero


@part
def _load_six(w, first, apart):
    """Return six rows that stand apart."""
    return (
        get(w, first), get(w, first + apart), get(w, first + 2 * apart),
        get(w, first + 3 * apart), get(w, first + 4 * apart), get(w, first + 5 * apart),
    )  # fmt: skip


@part
def _dot_six(a, b):
    """Return the sum of six products."""
    total = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return total + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@stage
def compute_task_jacobian(w, step, L="k, 6", k="count", J="6, n", n="count", A="k, n"):
    """Compute A = L J: (L, k, J, n, A).

    Two rows of L at a time stay in registers; the last one of an odd number is its own neighbour.
    """
    for i in range(0, k, 2):
        j = min(i + 1, k - 1)
        one, two = _load_six(w, L + 6 * i, 1), _load_six(w, L + 6 * j, 1)
        for c in range(n):
            column = _load_six(w, J + c, n)
            put(w, A + n * i + c, _dot_six(one, column))
            put(w, A + n * j + c, _dot_six(two, column))


@stage
def subtract_goal(w, step, k="count", s="k", s_goal="k", error="k"):
    """Compute error = s - s_goal: (k, s, s_goal, error)."""
    for i in range(k):
        put(w, error + i, get(w, s + i) - get(w, s_goal + i))


@stage
def compute_joint_command(w, step, n="count", gain="row", x="n", qd="n"):
    """Compute qd = -gain x: (n, gain, x, qd)."""
    for i in range(n):
        put(w, qd + i, -(get(w, gain) * get(w, x + i)))


@stage
def copy_rows(w, step, n="count", rows="n", to="n"):
    """Copy rows of a block to others: (n, from, to)."""
    for i in range(n):
        put(w, to + i, get(w, rows + i))


@stage
def multiply_transpose(w, step, A="k, n", k="count", n="count", y="k", x="n"):
    """Compute x = A' y: (A, k, n, y, x)."""
    for j in range(n):
        total = get(w, A + j) * get(w, y)
        for i in range(1, k):
            total = total + get(w, A + n * i + j) * get(w, y + i)
        put(w, x + j, total)


@stage
def solve_task(
    w,
    step,
    A="k, n",
    k="count",
    n="count",
    y="k",
    damping="row or none",
    rcond="row",
    x="n",
    rank="row",
    J="6, n or none",
    scratch="size",
    slides="whole",
    size="count",
):
    """Compute x = A^+ y: (A, k, n, y, damping or -1, rcond, x, rank, J, scratch)."""
    metres = J if J >= 0 else -1 - slides
    found = solve_block(w, A, k, n, y, damping, get(w, rcond), x, metres, scratch)
    put(w, rank, found)


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
    rcond="row",
    x="n",
    rank="row",
    scratch="size",
    size="count",
):
    """Compute x = (L J)^+ y: (L, k, J, n, L J, y, rcond, x, rank, scratch)."""
    share = get(w, rcond)
    found = solve_product_block(w, L, k, J, n, A, y, share, x, scratch)
    put(w, rank, found)


@stage
def scale_length_unit(w, step, A="n, m", n="count", m="count", length="row", how="whole", B="n, m"):
    """Compute B, the matrix A[n, m] in another unit of length: (A, n, m, unit, how, B).

    The first three rows are divided by it (how 0) or multiplied (2), or the first three columns
    multiplied (1).
    """
    unit = get(w, length)
    for i in range(n):
        for j in range(m):
            x = get(w, A + i * m + j)
            if (how == 1 and j < 3) or (how == 2 and i < 3):
                x = x * unit
            elif how == 0 and i < 3:
                x = x / unit
            put(w, B + i * m + j, x)


@stage
def weight_matrix_rows(w, step, A="n, m", n="count", m="count", weights="n", B="n, m"):
    """Compute B, each row that of A[n, m] times its own weight: (A, n, m, weights, B)."""
    for i in range(n):
        for j in range(m):
            put(w, B + i * m + j, get(w, weights + i) * get(w, A + i * m + j))


@stage
def average_rows(w, step, n="count", rows="n", others="n"):
    """Replace rows by the mean of themselves and others: (n, rows, others)."""
    for i in range(n):
        put(w, rows + i, 0.5 * (get(w, rows + i) + get(w, others + i)))


@stage
def express_in_first_camera(w, step, L="k, 6", k="count", A="6, 6", out="k, 6"):
    """Compute L of the first camera's twist, L A: (L, k, A, out), with V = A V_first."""
    for i in range(k):
        for j in range(6):
            total = 0.0 * get(w, L)
            for c in range(6):
                total = total + get(w, L + 6 * i + c) * get(w, A + 6 * c + j)
            put(w, out + 6 * i + j, total)


@stage
def adapt_gain(w, step, n="count", size_of="n", numbers="3", largest="whole", gain="row"):
    """Compute the gain at the size of an error or a command: (n, x, numbers, largest, gain).

    The numbers are those at zero and at infinity and the slope; the size is the norm or, if
    `largest`, the largest |x|.
    """
    zero = 0.0 * get(w, numbers)
    square, most = zero, zero
    for i in range(n):
        x = absolute(get(w, size_of + i))
        square, most = square + x * x, where(x > most, x, most)
    size = most if largest else sqrt(square)
    for i in range(WIDTH):
        at = numbers * WIDTH + i
        found = gain_at(w[at], w[at + WIDTH], w[at + 2 * WIDTH], get_lane(size, i))
        w[gain * WIDTH + i] = found


@stage
def multiply_vector(w, step, A="n, m", n="count", m="count", x="m", out="n"):
    """Compute out = A x: (A, n, m, x, out)."""
    for i in range(n):
        total = 0.0 * get(w, A)
        for j in range(m):
            total = total + get(w, A + m * i + j) * get(w, x + j)
        put(w, out + i, total)


@stage
def add_vectors(w, step, n="count", x="n", y="n", out="n"):
    """Compute out = x + y: (n, x, y, out)."""
    for i in range(n):
        put(w, out + i, get(w, x + i) + get(w, y + i))


@stage
def add_scaled_vector(
    w, step, n="count", x="n", factor="row", more_of="n", divided="whole", out="n"
):
    """Compute out = x + factor y, or x + y / factor: (n, x, factor, y, whether divided, out)."""
    factor = get(w, factor)
    for i in range(n):
        y = get(w, more_of + i)
        more = y / factor if divided else factor * y
        put(w, out + i, get(w, x + i) + more)


@stage
def estimate_drift(
    w, step, k="count", errors="k", before="k", moved="k", drifts="k", lag="row", dt="row"
):
    """Estimate the drift of the error that the command does not explain.

    (k, error, error before, what was moved, drift, lag, dt): a first-order filter.
    """
    share = get(w, dt) / (get(w, lag) + get(w, dt))
    for i in range(k):
        error, drift = get(w, errors + i), 0.0 * share
        if step > 0:
            drift = get(w, drifts + i)
            change = (error - get(w, before + i)) / get(w, dt)
            drift = drift + share * (change - get(w, moved + i) - drift)
        put(w, before + i, error)
        put(w, drifts + i, drift)


@stage
def mask_hidden_rows(w, step, A="n, m", n="count", m="count", hidden="n", out="n, m"):
    """Compute out, A[n, m] with zeros in hidden rows: (A, n, m, hidden, out)."""
    for i in range(n):
        for j in range(m):
            at = i * m + j
            put(w, out + at, where(get(w, hidden + i) > 0.0, 0.0, get(w, A + at)))


@stage
def widen_matrix(
    w, step, A="n, m", n="count", m="count", out="n, width", width="count", columns="each: whole"
):
    """Copy A[n, m] into some columns of a wider matrix: (A, n, m, out, width), and the columns."""
    for i in range(n):
        for j in range(m):
            put(w, out + i * width + columns[1 + j], get(w, A + i * m + j))


@stage
def compute_any(w, step, out="row", rows="each: row"):
    """Compute whether any of some rows is true: (n, out), and the rows."""
    found = 0.0 * get(w, rows[1])
    for i in range(rows[0]):
        found = where(get(w, rows[1 + i]) > 0.0, 1.0, found)
    put(w, out, found)


@stage
def clear_rows(w, step, n="count", rows="n"):
    """Set rows to zero: (n, first)."""
    for i in range(n):
        put(w, rows + i, 0.0)


@stage
def add_switched_velocity(w, step, n="count", qd="n", second="row", which="whole", to="each: row"):
    """Add velocities where it is their scheme's turn: (n, qd, second, which), and rows for each."""
    turn = get(w, second) == 1.0 * which
    for i in range(n):
        put(w, to[1 + i], get(w, to[1 + i]) + where(turn, get(w, qd + i), 0.0))
