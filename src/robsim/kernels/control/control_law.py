"""Stages of the control law: the camera Jacobian J, A = L J, least squares, and the command.

All matrices are stored in row-major order: L[k, 6], J[6, n] and A[k, n].
"""

import math

from robsim.kernels.formulas.adaptive_gain import gain_at
from robsim.kernels.formulas.lane_poses import pose_column
from robsim.kernels.formulas.lane_vectors import cross_product
from robsim.kernels.linear_algebra.pseudoinverse import solve_block
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, absolute, get, get_lane, put, sqrt, where
from robsim.kernels.machine.stages import stage


@part
def _write_in_axes(w, axes, J, n, x, y, z):
    """Write a vector, in axes of three components each, to three rows of a column of J[6, n]."""
    a, b, c = axes
    put(w, J, a[0] * x + a[1] * y + a[2] * z)
    put(w, J + n, b[0] * x + b[1] * y + b[2] * z)
    put(w, J + 2 * n, c[0] * x + c[1] * y + c[2] * z)


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
    """Compute the Jacobian J of a camera relative to its target, in camera axes.

    `robsim.kernels.formulas.jacobian` describes `moves`. A rotation about an axis a through o moves
    the camera at p with v = a x (p - o) and omega = a. A translation along a moves it with v = a.
    """
    C = T_w_c
    axes = pose_column(w, C, 0), pose_column(w, C, 1), pose_column(w, C, 2)
    p = pose_column(w, C, 3)
    zero = 0.0 * get(w, ratios)
    vx, vy, vz, ox, oy, oz = zero, zero, zero, zero, zero, zero
    for m in range(moves[0]):
        at = 1 + 6 * m
        column, T, axis = moves[at], poses + 12 * moves[at + 1], moves[at + 3]
        ratio = moves[at + 5] * get(w, ratios + moves[at + 4])
        a, b, c = pose_column(w, T, axis)
        if moves[at + 2]:
            o = pose_column(w, T, 3)
            x, y, z = cross_product(a, b, c, p[0] - o[0], p[1] - o[1], p[2] - o[2])
            vx, vy, vz = vx + ratio * x, vy + ratio * y, vz + ratio * z
            ox, oy, oz = ox + ratio * a, oy + ratio * b, oz + ratio * c
        else:
            vx, vy, vz = vx + ratio * a, vy + ratio * b, vz + ratio * c
        if m + 1 == moves[0] or moves[at + 6] != column:
            _write_in_axes(w, axes, J + column, n, vx, vy, vz)
            _write_in_axes(w, axes, J + column + 3 * n, n, ox, oy, oz)
            vx, vy, vz, ox, oy, oz = zero, zero, zero, zero, zero, zero


@part
def _load_six(w, first, stride):
    """Return six rows at a stride `stride`."""
    return (
        get(w, first), get(w, first + stride), get(w, first + 2 * stride),
        get(w, first + 3 * stride), get(w, first + 4 * stride), get(w, first + 5 * stride),
    )  # fmt: skip


@part
def _dot_six(a, b):
    """Return the dot product of two vectors of six components."""
    total = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return total + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@stage
def compute_task_jacobian(w, step, L="k, 6", k="count", J="6, n", n="count", A="k, n"):
    """Compute A = L J.

    Two rows of L at a time stay in registers. If k is odd, the last row is paired with itself.
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
    """Compute error = s - s_goal."""
    for i in range(k):
        put(w, error + i, get(w, s + i) - get(w, s_goal + i))


@stage
def compute_joint_command(w, step, n="count", gain="row", x="n", qd="n"):
    """Compute the command qd = -gain x."""
    for i in range(n):
        put(w, qd + i, -(get(w, gain) * get(w, x + i)))


@stage
def compute_error_force(
    w, step, errors="k", k="count", stiffness="row", width="row or none", force="k"
):
    """Compute force = stiffness f(errors), with f(e) = e, or width tanh(e / width).

    The force is the gradient of the potential energy with respect to the errors.
    """
    for i in range(k):
        if width < 0:
            put(w, force + i, get(w, stiffness) * get(w, errors + i))
        else:
            for b in range(WIDTH):
                most = w[width * WIDTH + b]
                bounded = most * math.tanh(w[(errors + i) * WIDTH + b] / most)
                w[(force + i) * WIDTH + b] = w[stiffness * WIDTH + b] * bounded


@stage
def measure_camera_step(w, step, J="6, n", n="count", qd="n", largest="row", share="row"):
    """Compute the largest component of the step J qd of a camera, as a share of the largest one."""
    most = 0.0 * get(w, largest)
    for i in range(6):
        total = 0.0 * most
        for j in range(n):
            total = total + get(w, J + n * i + j) * get(w, qd + j)
        size = absolute(total)
        most = where(size > most, size, most)
    put(w, share, most / get(w, largest))


@stage
def compare_step(w, step, share="row", busy="row"):
    """Set busy to 1 if a share exceeds 1, else to 0."""
    put(w, busy, where(get(w, share) > 1.0, 1.0, 0.0 * get(w, share)))


@stage
def copy_rows(w, step, n="count", rows="n", to="n"):
    """Copy n rows of a block to the rows `to`."""
    for i in range(n):
        put(w, to + i, get(w, rows + i))


@stage
def multiply_transpose(w, step, A="k, n", k="count", n="count", y="k", x="n"):
    """Compute x = A' y."""
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
    translations="whole",
    size="count",
):
    """Compute x = A^+ y, truncated or damped, and the rank of A.

    J determines the columns of A that are per metre. Without J these are the first `translations`
    columns.
    """
    metres = J if J >= 0 else -1 - translations
    put(w, rank, solve_block(w, A, k, n, y, damping, get(w, rcond), x, metres, scratch))


@stage
def scale_length_unit(
    w, step, A="n, m", n="count", m="count", length="row", mode="whole", B="n, m"
):
    """Compute B, the matrix A in another unit of length.

    The mode is 0 to divide the first three rows by the length, 1 to multiply the first three
    columns by it, and 2 to multiply the first three rows by it.
    """
    unit = get(w, length)
    for i in range(n):
        for j in range(m):
            x = get(w, A + i * m + j)
            if (mode == 1 and j < 3) or (mode == 2 and i < 3):
                x = x * unit
            elif mode == 0 and i < 3:
                x = x / unit
            put(w, B + i * m + j, x)


@stage
def weight_matrix_rows(w, step, A="n, m", n="count", m="count", weights="n", B="n, m"):
    """Compute B, the matrix A with each row multiplied by its weight."""
    for i in range(n):
        weight = get(w, weights + i)
        for j in range(m):
            put(w, B + i * m + j, weight * get(w, A + i * m + j))


@stage
def average_rows(w, step, n="count", rows="n", others="n"):
    """Replace n rows by the mean of these rows and `others`."""
    for i in range(n):
        put(w, rows + i, 0.5 * (get(w, rows + i) + get(w, others + i)))


@stage
def express_in_first_camera(w, step, L="k, 6", k="count", A="6, 6", out="k, 6"):
    """Compute out = L A, the interaction matrix for the first camera's twist, V = A V_first."""
    for i in range(k):
        for j in range(6):
            total = 0.0 * get(w, L)
            for c in range(6):
                total = total + get(w, L + 6 * i + c) * get(w, A + 6 * c + j)
            put(w, out + 6 * i + j, total)


@stage
def adapt_gain(w, step, n="count", vector="n", numbers="3", largest="whole", gain="row"):
    """Compute the adaptive gain for the size of an error or a command.

    The numbers are the gain at zero, the gain at infinity, and the slope. The size is the norm of
    `vector`, or its largest magnitude if `largest` is nonzero.
    """
    zero = 0.0 * get(w, numbers)
    square, most = zero, zero
    for i in range(n):
        x = absolute(get(w, vector + i))
        square, most = square + x * x, where(x > most, x, most)
    size = most if largest else sqrt(square)
    for i in range(WIDTH):
        at = numbers * WIDTH + i
        adapted_gain = gain_at(w[at], w[at + WIDTH], w[at + 2 * WIDTH], get_lane(size, i))
        w[gain * WIDTH + i] = adapted_gain


@stage
def multiply_vector(w, step, A="n, m", n="count", m="count", x="m", out="n"):
    """Compute out = A x."""
    for i in range(n):
        total = 0.0 * get(w, A)
        for j in range(m):
            total = total + get(w, A + m * i + j) * get(w, x + j)
        put(w, out + i, total)


@stage
def add_vectors(w, step, n="count", x="n", y="n", out="n"):
    """Compute out = x + y."""
    for i in range(n):
        put(w, out + i, get(w, x + i) + get(w, y + i))


@stage
def add_scaled_vector(w, step, n="count", x="n", factor="row", y="n", divide="whole", out="n"):
    """Compute out = x + factor y, or x + y / factor if `divide` is nonzero."""
    factor = get(w, factor)
    for i in range(n):
        entry = get(w, y + i)
        term = entry / factor if divide else factor * entry
        put(w, out + i, get(w, x + i) + term)


@stage
def estimate_drift(
    w,
    step,
    k="count",
    errors="k",
    last_errors="k",
    predicted_change="k",
    drifts="k",
    lag="row",
    dt="row",
):
    """Estimate the rate of the error that the command does not explain, by a first-order filter.

    `last_errors` holds the error of the last step, and `predicted_change` the error rate that the
    command causes. `lag` is the time constant of the filter.
    """
    share = get(w, dt) / (get(w, lag) + get(w, dt))
    for i in range(k):
        error, drift = get(w, errors + i), 0.0 * share
        if step > 0:
            drift = get(w, drifts + i)
            change = (error - get(w, last_errors + i)) / get(w, dt)
            drift = drift + share * (change - get(w, predicted_change + i) - drift)
        put(w, last_errors + i, error)
        put(w, drifts + i, drift)


@stage
def mask_hidden_rows(w, step, A="n, m", n="count", m="count", hidden="n", out="n, m"):
    """Compute out, the matrix A with zeros in its hidden rows."""
    for i in range(n):
        is_hidden = get(w, hidden + i) > 0.0
        for j in range(m):
            put(w, out + i * m + j, where(is_hidden, 0.0, get(w, A + i * m + j)))


@stage
def widen_matrix(
    w, step, A="n, m", n="count", m="count", out="n, width", width="count", columns="each: whole"
):
    """Copy the columns of A to the given columns of a wider matrix."""
    for i in range(n):
        for j in range(m):
            put(w, out + i * width + columns[1 + j], get(w, A + i * m + j))


@stage
def compute_any(w, step, out="row", rows="each: row"):
    """Compute 1 if any of the rows is positive, else 0."""
    flag = 0.0 * get(w, rows[1])
    for i in range(rows[0]):
        flag = where(get(w, rows[1 + i]) > 0.0, 1.0, flag)
    put(w, out, flag)


@stage
def clear_rows(w, step, n="count", rows="n"):
    """Set n rows to zero."""
    for i in range(n):
        put(w, rows + i, 0.0)


@stage
def add_switched_velocity(w, step, n="count", qd="n", second="row", scheme="whole", to="each: row"):
    """Add the velocities qd of a scheme to the rows `to` if this scheme commands.

    `scheme` is 0 for the first scheme and 1 for the second. The row `second` is 1 if the second
    scheme commands, else 0.
    """
    turn = get(w, second) == 1.0 * scheme
    for i in range(n):
        put(w, to[1 + i], get(w, to[1 + i]) + where(turn, get(w, qd + i), 0.0))


@stage
def command_optical_axis(w, step, k="count", s="k", errors="k", numbers="2", V="6"):
    """Compute v_z and omega_z of a camera's twist V.

    The last two of the k features are the angle and the area. The numbers are the gain of the roll,
    and the speed per unit of ln(sigma*/sigma) with the square root sigma of the area.
    """
    last = k - 1
    put(w, V + 5, get(w, numbers) * get(w, errors + last - 1))
    for i in range(WIDTH):
        area, error = w[(s + last) * WIDTH + i], w[(errors + last) * WIDTH + i]
        growth = math.log((area - error) / area)
        w[(V + 2) * WIDTH + i] = 0.5 * w[(numbers + 1) * WIDTH + i] * growth


@stage
def compensate_optical_axis(
    w, step, k="count", gain="row", errors="k", L="k, 6", V="6", rates="k", out="k, 4"
):
    """Compute rates = -gain e - L_z V_z, and `out`, the matrix L without its columns of z."""
    gain = get(w, gain)
    for i in range(k):
        row = L + 6 * i
        rate = -get(w, errors + i) * gain - get(w, row + 2) * get(w, V + 2)
        put(w, rates + i, rate - get(w, row + 5) * get(w, V + 5))
        for j in range(4):
            put(w, out + 4 * i + j, get(w, row + j + j // 2))
