"""The motion of vehicles by held velocities, exactly."""

import math

from robsim.kernels.formulas import se3
from robsim.kernels.machine.jit import kernel


@kernel
def integrate_in_plane(v, dt, q):
    """Move along the arc of a held velocity (vx, vy, omega), or (v, omega) with vy = 0.

    int_0^dt R(theta + omega t) dt = dt sinc(h) R(theta + h) with h = omega dt / 2: the chord of
    the arc, in the direction that the body has halfway. theta is not wrapped.
    """
    last = v.shape[0] - 1
    for b in range(q.shape[1]):
        half = 0.5 * dt * v[last, b]
        chord, halfway = dt * se3.sinc(half), q[2, b] + half
        c, s = chord * math.cos(halfway), chord * math.sin(halfway)
        vx, vy = v[0, b], v[1, b] if last == 2 else 0.0
        q[0, b] += c * vx - s * vy
        q[1, b] += s * vx + c * vy
        q[2, b] += dt * v[last, b]


@kernel
def turn_steering_angle(row, velocity, wheelbase, limit, rate, dt, q, v):
    """Turn the steering angle q[row, b] of a car towards that of the omega in v.

    tan(angle) = wheelbase omega/v, within the limit, and no more than rate |dt| from where it was.
    A car that stands keeps its angle.
    """
    step = rate * abs(dt)
    for b in range(q.shape[1]):
        speed, turn_rate, angle = v[velocity, b], v[velocity + 1, b], q[row, b]
        if speed != 0.0:
            wanted = math.atan(wheelbase * turn_rate / speed)
            wanted = min(max(wanted, -limit), limit)
            angle += min(max(wanted - angle, -step), step)
        q[row, b] = angle


@kernel
def set_yaw_rate(row, velocity, wheelbase, q, v):
    """Replace omega of a car by that of its steering angle: v tan(angle)/wheelbase."""
    for b in range(q.shape[1]):
        v[velocity + 1, b] = v[velocity, b] * math.tan(q[row, b]) / wheelbase
