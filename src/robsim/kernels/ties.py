"""Coordinates that depend on others, and wheels that roll below their vehicles."""

import math
from typing import Any, NamedTuple

from robsim.kernels import curve
from robsim.kernels.jit import kernel

MIMIC, CHORD, ACKERMANN = 0, 1, 2


class Ties(NamedTuple):
    """Coordinates that depend on one other, each after the one that it depends on."""

    # (ties, 5): MIMIC, CHORD or ACKERMANN; row of x that it depends on; row of the ratio that is
    # its derivative by the velocity of its root; of a chord its curve, and what it gives
    rows: Any
    # (ties, 3) MIMIC: ratio, offset. CHORD: length, radius, at. ACKERMANN: wheelbase, x, y
    numbers: Any


class Wheels(NamedTuple):
    """Wheels that roll below their vehicle, with the hub at (x, y) of it."""

    # (wheels, 4): row of their angle in q; v of the vehicle, omega is the next; row of x by whose
    # angle the wheel is turned, or -1; ratio of what v adds to its speed, that of omega is the next
    rows: Any
    numbers: Any  # (wheels, 3): radius, x, y


@kernel
def steered(angle, wheelbase, x, y):
    """Return the angle of a wheel at (x, y) of a car, and its derivative by the steering angle.

    tan = x sin/(wheelbase cos - y sin): all axles meet in one point (R. N. Jazar, Vehicle
    Dynamics, 2008, section 7.1).
    """
    c, s = math.cos(angle), math.sin(angle)
    near, far = wheelbase * c - y * s, x * s
    return math.atan2(far, near), x * wheelbase / (near * near + far * far)


@kernel
def depend(ties, curves, x, ratio):
    """Fill the rows of x[:, b] that depend on others, and their derivatives."""
    first = x.shape[0] - ties.rows.shape[0]
    for i in range(ties.rows.shape[0]):
        kind, source, row, which, gives = ties.rows[i]
        above = 0 if source < first else ties.rows[source - first, 2]
        for b in range(x.shape[1]):
            u, v, w = ties.numbers[i]
            if kind == CHORD:
                x[first + i, b], slope = curve.chord(curves, which, x[source, b], u, v, w, gives)
            elif kind == ACKERMANN:
                x[first + i, b], slope = steered(x[source, b], u, v, w)
            else:
                x[first + i, b], slope = u * x[source, b] + v, u
            ratio[row, b] = slope * ratio[above, b]


@kernel
def spin(wheels, x, ratio):
    """Compute the factors of v and omega of a vehicle in the speeds of its wheels, in rad/s.

    The hub at (x, y) moves at (v - omega y, omega x); a wheel of radius R, turned by the angle h,
    rolls at (cos(h) (v - omega y) + sin(h) omega x)/R.
    """
    for i in range(wheels.rows.shape[0]):
        _, _, steering, row = wheels.rows[i]
        R, X, Y = wheels.numbers[i]
        for b in range(x.shape[1]):
            angle = x[steering, b] if steering >= 0 else 0.0
            c, s = math.cos(angle), math.sin(angle)
            ratio[row, b], ratio[row + 1, b] = c / R, (s * X - c * Y) / R
