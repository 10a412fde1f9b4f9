"""The angles of a car's steered wheels."""

import math

from robsim.kernels.machine.jit import kernel


@kernel
def wheel_steering_angle(angle, wheelbase, x, y):
    """Return the angle of a car's wheel at (x, y), and its derivative by the steering angle a.

    The tangent of the wheel's angle is x sin(a)/(wheelbase cos(a) - y sin(a)), so all axles meet in
    one point (R. N. Jazar, Vehicle Dynamics, 2008, section 7.1).
    """
    c, s = math.cos(angle), math.sin(angle)
    near, far = wheelbase * c - y * s, x * s
    return math.atan2(far, near), x * wheelbase / (near * near + far * far)
