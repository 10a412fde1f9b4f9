"""Coordinates that depend on others, and wheels that roll below their vehicles."""

import math
from typing import Any, NamedTuple

from robsim.kernels.machine.jit import kernel

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
