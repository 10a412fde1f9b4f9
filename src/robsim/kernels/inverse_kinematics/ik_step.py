"""Stages of a step of inverse kinematics, by damped least squares.

The step is (J'J + w I)^-1 J'e with w in proportion to the squared error: S. K. Chan and
P. D. Lawrence, General inverse kinematics with the error damped pseudoinverse, ICRA 1988;
T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE
T-RO 27(5), 2011.
"""

import math

from robsim.kernels.formulas.se3 import rotation_to_quaternion, rotation_vector
from robsim.kernels.machine.array_views import matrix, vector
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import WIDTH, floor, get, put, sqrt, where
from robsim.kernels.machine.stages import stage

DAMPING = 0.015  # times e'e
FAR = 10.0  # of e'e: more than that does not damp more, or steps would be too small to arrive
FLOOR = 1e-12  # of the damping: keeps Cholesky's pivots positive
STILL = 1e-3  # cosine of e and the columns of J, and share of e'e that a step would gain
TURN = 2.0 * math.pi


@stage
def compute_rotation_error(w, step, goal="3, 4", T="3, 4", room="16", vector_of="3"):
    """Compute the rotation vector of R_goal R', in base axes: (goal, T, room of 16, vector)."""
    between, quaternion = room, vector(w, room + 12, 4)
    for r in range(0, 12, 4):
        for c in range(3):
            a, b = goal + r, T + 4 * c
            total = get(w, a) * get(w, b) + get(w, a + 1) * get(w, b + 1)
            put(w, between + r + c, total + get(w, a + 2) * get(w, b + 2))
    rotation_to_quaternion(matrix(w, between, 3, 4), quaternion)
    rotation_vector(quaternion, vector(w, vector_of, 3))


@part
def _rotation_axis(w, T, c, i):
    """Return an axis of the rotation of a run."""
    at = (T + c) * WIDTH + i
    return w[at], w[at + 4 * WIDTH], w[at + 8 * WIDTH]


@stage
def compute_axis_error(w, step, goal="3, 4", T="3, 4", vector_of="3"):
    """Compute the vector of the shortest rotation of the z axis of T to that of the goal.

    In base axes: (goal, T, vector).
    """
    for i in range(WIDTH):
        zx, zy, zz = _rotation_axis(w, T, 2, i)
        gx, gy, gz = _rotation_axis(w, goal, 2, i)
        x, y, z = zy * gz - zz * gy, zz * gx - zx * gz, zx * gy - zy * gx
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, zx * gx + zy * gy + zz * gz)
        if sine == 0.0:  # straight on, or straight back: then about x
            x, y, z = _rotation_axis(w, T, 0, i)
            sine = 1.0
        at, scale = vector_of * WIDTH + i, angle / sine
        w[at], w[at + WIDTH], w[at + 2 * WIDTH] = scale * x, scale * y, scale * z


@stage
def ignore_roll(w, step, T="3, 4", n="count", J="6, n"):
    """Remove rotation about the z axis of T from the lower rows of J[6, n]: (T, n, J)."""
    x, y, z = get(w, T + 2), get(w, T + 6), get(w, T + 10)
    for j in range(J + 3 * n, J + 4 * n):
        a, b, c = get(w, j), get(w, j + n), get(w, j + 2 * n)
        roll = x * a + y * b + z * c
        put(w, j, a - roll * x)
        put(w, j + n, b - roll * y)
        put(w, j + 2 * n, c - roll * z)


@part
def _weighted_length(w, e, weights):
    """Return the length of three rows, without those of weight zero."""
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
    """Weigh e, of which the rotation is there, and add p_goal - p before it.

    (goal, T, weights, e, error, square, boost, damping): the error is that without weights, and
    the damping follows from the square e'e.
    """
    for r in range(3):
        put(w, e + r, get(w, goal + 4 * r + 3) - get(w, T + 4 * r + 3))
    far, turned = _weighted_length(w, e, weights), _weighted_length(w, e + 3, weights + 3)
    put(w, error, where(turned > far, turned, far))  # where a turn is not a number, far is none
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
    downhill="n",
    stopped="row",
    joints="each: column=whole; x=row; limits=2",
):
    """Exclude joints at a limit that would move outwards from the step.

    (n, J[6, n], J'e, how many are held, joints), and of each joint its column, its coordinate, and
    the first of the rows of its limits.
    """
    held = 0.0 * get(w, J)
    for i in range(joints[0]):
        j, x, limits = joints[1 + 3 * i], get(w, joints[2 + 3 * i]), joints[3 + 3 * i]
        slope = get(w, downhill + j)
        below = (x <= get(w, limits)) & (slope < 0.0)
        stops = below | ((x >= get(w, limits + 1)) & (slope > 0.0))
        held = held + where(stops, 1.0, 0.0)
        put(w, downhill + j, where(stops, 0.0, slope))
        for r in range(J + j, J + j + 6 * n, n):
            put(w, r, where(stops, 0.0, get(w, r)))
    put(w, stopped, held)


@stage
def detect_stationary(
    w, step, n="count", J="6, n", downhill="n", qd="n", squared="row", gained="row", still="row"
):
    """Judge whether the step gains little, and e is normal to all columns of J.

    (n, J[6, n], J'e, the step, e'e, gain, whether it is still)
    """
    square = get(w, squared)
    none = 0.0 * get(w, J)
    gain, cosine = none, none  # the cosine squared, times e'e
    for j in range(n):
        slope, column = get(w, downhill + j), none
        for r in range(J + j, J + j + 6 * n, n):
            column = column + get(w, r) * get(w, r)
        gain = gain + slope * get(w, qd + j)
        share = slope * slope / where(column > 0.0, column, 1.0)
        cosine = where((column > 0.0) & (share > cosine), share, cosine)
    few = STILL * square
    put(w, gained, gain)
    put(w, still, where((gain <= few) & (cosine <= STILL * few), 1.0, 0.0))


@stage
def confine_coordinates(w, step, joints="each: x=row; limits=2; turns=whole"):
    """Move coordinates into their limits: by whole turns where that helps, else to the limit.

    (n), and of each its row, the first of the rows of its limits, whether it turns.
    """
    for i in range(joints[0]):
        row, limits = joints[1 + 3 * i], joints[2 + 3 * i]
        x, low, high = get(w, row), get(w, limits), get(w, limits + 1)
        found = where(x < low, low, where(x > high, high, x))
        if joints[3 + 3 * i]:
            turned = x + TURN * floor((high - x) / TURN)
            found = where((low <= turned) & (turned <= high), turned, found)
        put(w, row, where((low <= x) & (x <= high), x, found))
