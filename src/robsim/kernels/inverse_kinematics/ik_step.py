"""Stages of an iteration of inverse kinematics by damped least squares.

The step is (J'J + w I)^-1 J'e with w proportional to the squared error: S. K. Chan and
P. D. Lawrence, General inverse kinematics with the error damped pseudoinverse, ICRA 1988;
T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE
T-RO 27(5), 2011.
"""

import math

from robsim.kernels.formulas.lane_vectors import put_vector
from robsim.kernels.formulas.pose_interpolation import rotation_in_base_axes
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import WIDTH, floor, get, put, sqrt, where
from robsim.kernels.machine.stages import stage

DAMPING = 0.015  # factor of e'e
FAR = 10.0  # upper bound of e'e in the damping: larger damping would make steps too small
FLOOR = 1e-12  # least damping, which keeps Cholesky's pivots positive
STILL = 1e-3  # a search is stationary below this cosine of e and columns, and this share of e'e
TURN = 2.0 * math.pi


@stage
def compute_rotation_error(w, step, goal="3, 4", T="3, 4", out="3"):
    """Compute the rotation vector of R_goal R' in base axes."""
    x, y, z = rotation_in_base_axes(w, T, goal)
    put_vector(w, out, x, y, z)


@part
def _rotation_axis(w, T, c, i):
    """Return axis c of the rotation of lane i."""
    at = (T + c) * WIDTH + i
    return w[at], w[at + 4 * WIDTH], w[at + 8 * WIDTH]


@stage
def compute_axis_error(w, step, goal="3, 4", T="3, 4", out="3"):
    """Compute the shortest rotation vector from the z axis of T to the z axis of the goal.

    The vector is in base axes.
    """
    for i in range(WIDTH):
        zx, zy, zz = _rotation_axis(w, T, 2, i)
        gx, gy, gz = _rotation_axis(w, goal, 2, i)
        x, y, z = zy * gz - zz * gy, zz * gx - zx * gz, zx * gy - zy * gx
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, zx * gx + zy * gy + zz * gz)
        if sine == 0.0:  # the axes are parallel or opposite: rotate about x
            x, y, z = _rotation_axis(w, T, 0, i)
            sine = 1.0
        at, scale = out * WIDTH + i, angle / sine
        w[at], w[at + WIDTH], w[at + 2 * WIDTH] = scale * x, scale * y, scale * z


@stage
def ignore_roll(w, step, T="3, 4", n="count", J="6, n"):
    """Remove the rotation about the z axis of T from the lower three rows of J[6, n]."""
    x, y, z = get(w, T + 2), get(w, T + 6), get(w, T + 10)
    for j in range(J + 3 * n, J + 4 * n):
        a, b, c = get(w, j), get(w, j + n), get(w, j + 2 * n)
        roll = x * a + y * b + z * c
        put(w, j, a - roll * x)
        put(w, j + n, b - roll * y)
        put(w, j + 2 * n, c - roll * z)


@part
def _weighted_length(w, e, weights):
    """Return the length of three rows, excluding rows of weight zero."""
    square = 0.0 * get(w, weights)
    for r in range(3):
        x = get(w, e + r)
        square = square + where(get(w, weights + r) > 0.0, x * x, 0.0)
    return sqrt(square)


@stage
def compute_residual(
    w,
    step,
    goal="3, 4",
    T="3, 4",
    weights="6",
    e="6",
    error="row",
    squared="row",
    boost="row",
    damping="row",
):
    """Compute the weighted e, its square e'e, the unweighted error, and the damping.

    The lower three rows of e hold the rotation error on entry. The upper three rows become
    p_goal - p. The damping is proportional to e'e.
    """
    for r in range(3):
        put(w, e + r, get(w, goal + 4 * r + 3) - get(w, T + 4 * r + 3))
    distance, angle = _weighted_length(w, e, weights), _weighted_length(w, e + 3, weights + 3)
    # if the rotation is NaN, so is the distance
    put(w, error, where(angle > distance, angle, distance))
    square = 0.0 * get(w, weights)
    for r in range(6):
        x = get(w, e + r) * get(w, weights + r)
        put(w, e + r, x)
        square = square + x * x
    put(w, squared, square)
    put(w, damping, DAMPING * get(w, boost) * where(square < FAR, square, FAR) + FLOOR)


@stage
def hold_limited_joints(
    w,
    step,
    n="count",
    J="6, n",
    descent="n",
    held_count="row",
    joints="each: column=whole; x=row; limits=2",
):
    """Exclude joints from the step that are at a limit and would move outwards.

    `descent` is J'e, and `held_count` the number of excluded joints. Their columns of J and their
    entries of J'e become zero.
    """
    count = 0.0 * get(w, J)
    for i in range(joints[0]):
        j, x, limits = joints[1 + 3 * i], get(w, joints[2 + 3 * i]), joints[3 + 3 * i]
        slope = get(w, descent + j)
        below = (x <= get(w, limits)) & (slope < 0.0)
        stops = below | ((x >= get(w, limits + 1)) & (slope > 0.0))
        count = count + where(stops, 1.0, 0.0)
        put(w, descent + j, where(stops, 0.0, slope))
        for r in range(J + j, J + j + 6 * n, n):
            put(w, r, where(stops, 0.0, get(w, r)))
    put(w, held_count, count)


@stage
def detect_stationary(
    w,
    step,
    n="count",
    J="6, n",
    descent="n",
    qd="n",
    squared="row",
    predicted_decrease="row",
    stationary="row",
):
    """Compute `stationary`: 1 if e'e falls little and e is normal to all columns of J, else 0.

    `descent` is J'e, qd the step, and `squared` e'e. `predicted_decrease` is a lower bound of the
    decrease of e'e that the linear model predicts.
    """
    square = get(w, squared)
    zero = 0.0 * get(w, J)
    gain, cosine = zero, zero  # `cosine` is the squared cosine times e'e
    for j in range(n):
        slope, column = get(w, descent + j), zero
        for r in range(J + j, J + j + 6 * n, n):
            column = column + get(w, r) * get(w, r)
        gain = gain + slope * get(w, qd + j)
        share = slope * slope / where(column > 0.0, column, 1.0)
        cosine = where((column > 0.0) & (share > cosine), share, cosine)
    few = STILL * square
    put(w, predicted_decrease, gain)
    put(w, stationary, where((gain <= few) & (cosine <= STILL * few), 1.0, 0.0))


@stage
def confine_coordinates(w, step, joints="each: x=row; limits=2; turns=whole"):
    """Move coordinates into their limits.

    A revolute joint (`turns`) moves by whole turns if this is sufficient. Otherwise the coordinate
    moves to the nearest limit.
    """
    for i in range(joints[0]):
        row, limits = joints[1 + 3 * i], joints[2 + 3 * i]
        x, low, high = get(w, row), get(w, limits), get(w, limits + 1)
        inside = where(x < low, low, where(x > high, high, x))
        if joints[3 + 3 * i]:
            shifted = x + TURN * floor((high - x) / TURN)
            inside = where((low <= shifted) & (shifted <= high), shifted, inside)
        put(w, row, where((low <= x) & (x <= high), x, inside))
