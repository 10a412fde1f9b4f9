"""Stages of a step of inverse kinematics, by damped least squares.

The step is (J'J + w I)^-1 J'e with w in proportion to the squared error: S. K. Chan and
P. D. Lawrence, General inverse kinematics with the error damped pseudoinverse, ICRA 1988;
T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, IEEE
T-RO 27(5), 2011.
"""

import math

from robsim.kernels.formulas.se3 import rotation_to_quaternion, rotation_vector
from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import WIDTH, floor, get, put, sqrt, where
from robsim.kernels.machine.memory import matrix, vector
from robsim.kernels.machine.stage import stage

DAMPING = 0.015  # times e'e
FAR = 10.0  # of e'e: more than that does not damp more, or steps would be too small to arrive
FLOOR = 1e-12  # of the damping: keeps Cholesky's pivots positive
STILL = 1e-3  # cosine of e and the columns of J, and share of e'e that a step would gain
TURN = 2.0 * math.pi


@stage
def turn_to(p, w, step):
    """Compute the rotation vector of R_goal R', in base axes: (goal, T, room of 16, vector)."""
    goal, T, between, quaternion = p[0], p[1], p[2], vector(w, p[2] + 12, 4)
    for r in range(0, 12, 4):
        for c in range(3):
            a, b = goal + r, T + 4 * c
            total = get(w, a) * get(w, b) + get(w, a + 1) * get(w, b + 1)
            put(w, between + r + c, total + get(w, a + 2) * get(w, b + 2))
    rotation_to_quaternion(matrix(w, between, 3, 4), quaternion)
    rotation_vector(quaternion, vector(w, p[3], 3))


@part
def _column(w, T, c, i):
    """Return an axis of the rotation of a run."""
    at = (T + c) * WIDTH + i
    return w[at], w[at + 4 * WIDTH], w[at + 8 * WIDTH]


@stage
def point_to(p, w, step):
    """Compute the vector of the shortest rotation of the z axis of T to that of the goal.

    In base axes: (goal, T, vector).
    """
    for i in range(WIDTH):
        zx, zy, zz = _column(w, p[1], 2, i)
        gx, gy, gz = _column(w, p[0], 2, i)
        x, y, z = zy * gz - zz * gy, zz * gx - zx * gz, zx * gy - zy * gx
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, zx * gx + zy * gy + zz * gz)
        if sine == 0.0:  # straight on, or straight back: then about x
            x, y, z = _column(w, p[1], 0, i)
            sine = 1.0
        at, scale = p[2] * WIDTH + i, angle / sine
        w[at], w[at + WIDTH], w[at + 2 * WIDTH] = scale * x, scale * y, scale * z


@stage
def ignore_roll(p, w, step):
    """Remove rotation about the z axis of T from the lower rows of J[6, n]: (T, n, J)."""
    x, y, z, n = get(w, p[0] + 2), get(w, p[0] + 6), get(w, p[0] + 10), p[1]
    for j in range(p[2] + 3 * n, p[2] + 4 * n):
        a, b, c = get(w, j), get(w, j + n), get(w, j + 2 * n)
        roll = x * a + y * b + z * c
        put(w, j, a - roll * x)
        put(w, j + n, b - roll * y)
        put(w, j + 2 * n, c - roll * z)


@part
def _length(w, e, weights):
    """Return the length of three rows, without those of weight zero."""
    square = 0.0 * get(w, weights)
    for r in range(3):
        x = get(w, e + r)
        square = square + where(get(w, weights + r) > 0.0, x * x, 0.0)
    return sqrt(square)


@stage
def residual(p, w, step):
    """Weigh e, of which the rotation is there, and add p_goal - p before it.

    (goal, T, weights, e, error, square, boost, damping): the error is that without weights, and
    the damping follows from the square e'e.
    """
    goal, T, weights, e = p[0], p[1], p[2], p[3]
    for r in range(3):
        put(w, e + r, get(w, goal + 4 * r + 3) - get(w, T + 4 * r + 3))
    far, turned = _length(w, e, weights), _length(w, e + 3, weights + 3)
    put(w, p[4], where(turned > far, turned, far))  # where a turn is not a number, far is none
    square = 0.0 * get(w, weights)
    for r in range(6):
        x = get(w, e + r) * get(w, weights + r)
        put(w, e + r, x)
        square = square + x * x
    put(w, p[5], square)
    put(w, p[7], DAMPING * get(w, p[6]) * where(square < FAR, square, FAR) + FLOOR)


@stage
def hold(p, w, step):
    """Exclude joints at a limit that would move outwards from the step.

    (n, J[6, n], J'e, how many are held, joints), and of each joint its column, its coordinate, and
    the first of the rows of its limits.
    """
    n, J, downhill = p[0], p[1], p[2]
    held = 0.0 * get(w, J)
    for i in range(p[4]):
        j, x, limits = p[5 + 3 * i], get(w, p[6 + 3 * i]), p[7 + 3 * i]
        slope = get(w, downhill + j)
        below = (x <= get(w, limits)) & (slope < 0.0)
        stops = below | ((x >= get(w, limits + 1)) & (slope > 0.0))
        held = held + where(stops, 1.0, 0.0)
        put(w, downhill + j, where(stops, 0.0, slope))
        for r in range(J + j, J + j + 6 * n, n):
            put(w, r, where(stops, 0.0, get(w, r)))
    put(w, p[3], held)


@stage
def judge(p, w, step):
    """Judge whether the step gains little, and e is normal to all columns of J.

    (n, J[6, n], J'e, the step, e'e, gain, whether it is still)
    """
    n, J, square = p[0], p[1], get(w, p[4])
    none = 0.0 * get(w, J)
    gain, cosine = none, none  # the cosine squared, times e'e
    for j in range(n):
        slope, column = get(w, p[2] + j), none
        for r in range(J + j, J + j + 6 * n, n):
            column = column + get(w, r) * get(w, r)
        gain = gain + slope * get(w, p[3] + j)
        share = slope * slope / where(column > 0.0, column, 1.0)
        cosine = where((column > 0.0) & (share > cosine), share, cosine)
    few = STILL * square
    put(w, p[5], gain)
    put(w, p[6], where((gain <= few) & (cosine <= STILL * few), 1.0, 0.0))


@stage
def confine(p, w, step):
    """Move coordinates into their limits: by whole turns where that helps, else to the limit.

    (n), and of each its row, the first of the rows of its limits, whether it turns.
    """
    for i in range(p[0]):
        row, limits = p[1 + 3 * i], p[2 + 3 * i]
        x, low, high = get(w, row), get(w, limits), get(w, limits + 1)
        found = where(x < low, low, where(x > high, high, x))
        if p[3 + 3 * i]:
            turned = x + TURN * floor((high - x) / TURN)
            found = where((low <= turned) & (turned <= high), turned, found)
        put(w, row, where((low <= x) & (x <= high), x, found))
