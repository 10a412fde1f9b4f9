"""Stages that place bodies relative to their parents, and the carriers of an arm in the world."""

from robsim.kernels.dynamics.body_rows import ACCELERATION, POSITION, TURNING, TURNING_RATE
from robsim.kernels.formulas import se3
from robsim.kernels.formulas.lane_math import cos_sin, is_large_angle, near_cos_sin
from robsim.kernels.formulas.lane_vectors import get_vector, put_vector, times_transpose
from robsim.kernels.machine.lanes import align_stack, any_lane, get, put
from robsim.kernels.machine.stages import stage


@stage
def place_on_revolute(w, step, each="each: place=3, 4; x=row; body=62"):
    """Compute the poses of bodies on revolute joints in their parents.

    All cosines and sines are computed first, without a call of a library.
    """
    align_stack()
    far = is_large_angle(get(w, each[2]))
    for i in range(each[0]):
        body = each[3 * i + 3]
        x = get(w, each[3 * i + 2])
        c, s = near_cos_sin(x)
        far = far | is_large_angle(x)
        put(w, body + POSITION, c)
        put(w, body + POSITION + 1, s)
    if any_lane(far):
        for i in range(each[0]):
            body = each[3 * i + 3]
            c, s = cos_sin(get(w, each[3 * i + 2]))
            put(w, body + POSITION, c)
            put(w, body + POSITION + 1, s)
    for i in range(each[0]):
        place, body = each[3 * i + 1], each[3 * i + 3]
        c, s = get(w, body + POSITION), get(w, body + POSITION + 1)
        for r in range(3):
            a, b = get(w, place + 4 * r), get(w, place + 4 * r + 1)
            put(w, body + 3 * r, c * a + s * b)
            put(w, body + 3 * r + 1, c * b - s * a)
            put(w, body + 3 * r + 2, get(w, place + 4 * r + 2))
            put(w, body + POSITION + r, get(w, place + 4 * r + 3))


@stage
def place_on_prismatic(w, step, each="each: place=3, 4; x=row; body=62"):
    """Compute the poses of bodies on prismatic joints in their parents."""
    for i in range(each[0]):
        place, body = each[3 * i + 1], each[3 * i + 3]
        x = get(w, each[3 * i + 2])
        for r in range(3):
            for c in range(3):
                put(w, body + 3 * r + c, get(w, place + 4 * r + c))
            put(w, body + POSITION + r, get(w, place + 4 * r + 3) + get(w, place + 4 * r + 2) * x)


@stage
def place_on_floating(w, step, each="each: place=3, 4; x=row; body=62"):
    """Compute the poses of floating bodies in their parents: position, quaternion (x, y, z, w)."""
    for i in range(each[0]):
        place, q, body = each[3 * i + 1], each[3 * i + 2], each[3 * i + 3]
        R = se3.quaternion_to_rotation(get(w, q + 3), get(w, q + 4), get(w, q + 5), get(w, q + 6))
        x, y, z = get_vector(w, q)
        for r in range(3):
            a, b, c = get_vector(w, place + 4 * r)
            put(w, body + POSITION + r, get(w, place + 4 * r + 3) + (a * x + b * y + c * z))
            for j in range(3):
                put(w, body + 3 * r + j, a * R[0][j] + b * R[1][j] + c * R[2][j])


@stage
def follow_coordinates(w, step, each="each: source=row; ratio=row; offset=row; x=row"):
    """Compute coordinates x = ratio source + offset of bodies on mimicking joints."""
    for i in range(each[0]):
        source, ratio = get(w, each[4 * i + 1]), get(w, each[4 * i + 2])
        put(w, each[4 * i + 4], ratio * source + get(w, each[4 * i + 3]))


@stage
def follow_rates(w, step, each="each: source=row; ratio=row; v=row"):
    """Compute velocities or accelerations v = ratio source of bodies on joints."""
    for i in range(each[0]):
        put(w, each[3 * i + 3], get(w, each[3 * i + 2]) * get(w, each[3 * i + 1]))


@stage
def collect_forces(w, step, n="count", tau="n", each="each: force=row; ratio=row; column=whole"):
    """Compute generalised forces: the sum of the forces of joints times their ratios."""
    for j in range(n):
        put(w, tau + j, 0.0)
    for i in range(each[0]):
        at = tau + each[3 * i + 3]
        put(w, at, get(w, at) + get(w, each[3 * i + 2]) * get(w, each[3 * i + 1]))


@stage
def move_carriers(w, step, gravity="3", each="each: rotation=9; omega=3; acceleration=3; body=62"):
    """Write the motion of carriers, with their acceleration against gravity, to their bodies."""
    gx, gy, gz = get_vector(w, gravity)
    for i in range(each[0]):
        R, body = each[4 * i + 1], each[4 * i + 4]
        x, y, z = times_transpose(w, R, gx, gy, gz)
        a, b, c = get_vector(w, each[4 * i + 3])
        put_vector(w, body + ACCELERATION, a - x, b - y, c - z)
        x, y, z = get_vector(w, each[4 * i + 2])
        put_vector(w, body + TURNING, x, y, z)
        put_vector(w, body + TURNING_RATE, 0.0, 0.0, 0.0)
