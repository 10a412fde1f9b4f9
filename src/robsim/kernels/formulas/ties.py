"""The angles of wheels that a car steers."""

import math

from robsim.kernels.machine.jit import kernel


@kernel
def wheel_steering_angle(angle, wheelbase, x, y):
    """Return the angle of a wheel at (x, y) of a car, and its derivative by the steering angle.

    tan = x sin/(wheelbase cos - y sin): all axles meet in one point (R. N. Jazar, Vehicle
    Dynamics, 2008, section 7.1).
    """
    c, s = math.cos(angle), math.sin(angle)
    near, far = wheelbase * c - y * s, x * s
    return math.atan2(far, near), x * wheelbase / (near * near + far * far)
