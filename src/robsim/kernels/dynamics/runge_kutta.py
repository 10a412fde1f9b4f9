"""Runge-Kutta method of order 4 for the motion of joints (Hairer, Norsett and Wanner 1993, II.1).

The state x holds coordinates and velocities. A floating joint has the coordinates of a position and
a quaternion, whose length is restored after each step.
"""

from robsim.kernels.formulas import se3
from robsim.kernels.machine.lanes import get, put, sqrt
from robsim.kernels.machine.stages import stage


@stage
def begin_step(w, step, n="count", x="n", start="n", total="n"):
    """Store the state at the start of a step, and set the sum of slopes to zero."""
    for i in range(n):
        put(w, start + i, get(w, x + i))
        put(w, total + i, 0.0)


@stage
def compute_coordinate_rates(
    w, step, single="each: v=row; rate=row", floating="each: q=7; v=6; rate=7"
):
    """Compute the rates of coordinates: velocities, and for floating joints R v and q omega / 2."""
    for i in range(single[0]):
        put(w, single[2 * i + 2], get(w, single[2 * i + 1]))
    for i in range(floating[0]):
        q, v, rate = floating[3 * i + 1], floating[3 * i + 2], floating[3 * i + 3]
        x, y, z, u = get(w, q + 3), get(w, q + 4), get(w, q + 5), get(w, q + 6)
        R = se3.quaternion_to_rotation(x, y, z, u)
        for r in range(3):
            along = R[r][0] * get(w, v) + R[r][1] * get(w, v + 1) + R[r][2] * get(w, v + 2)
            put(w, rate + r, along)
        a, b, c = 0.5 * get(w, v + 3), 0.5 * get(w, v + 4), 0.5 * get(w, v + 5)
        put(w, rate + 3, u * a + y * c - z * b)
        put(w, rate + 4, u * b + z * a - x * c)
        put(w, rate + 5, u * c + x * b - y * a)
        put(w, rate + 6, -(x * a + y * b + z * c))


@stage
def advance_state(
    w, step, n="count", slope="n", start="n", x="n", total="n", h="row", number="whole"
):
    """Add the slope with a number from 0 to 3 to the sum, and compute the next state.

    The slopes have the weights 1/6, 1/3, 1/3 and 1/6.
    """
    h = get(w, h)
    ahead = 0.5 * h if number < 2 else h
    share = 1.0 / 3.0 if 0 < number < 3 else 1.0 / 6.0
    for i in range(n):
        k = get(w, slope + i)
        sum = get(w, total + i) + share * k
        put(w, total + i, sum)
        if number == 3:
            put(w, x + i, get(w, start + i) + h * sum)
        else:
            put(w, x + i, get(w, start + i) + ahead * k)


@stage
def normalize_quaternions(w, step, each="each: q=7"):
    """Divide the quaternions of floating joints by their lengths."""
    for i in range(each[0]):
        q = each[i + 1] + 3
        size = 0.0 * get(w, q)
        for k in range(4):
            size = size + get(w, q + k) * get(w, q + k)
        size = sqrt(size)
        for k in range(4):
            put(w, q + k, get(w, q + k) / size)
