"""Exact motion of vehicles with constant velocities."""

import math

from robsim.kernels.formulas import se3
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel


@kernel
def integrate_in_plane(v, dt, q):
    """Integrate q = (x, y, theta) for a constant velocity (vx, vy, omega), or (v, omega), over dt.

    int_0^dt R(theta + omega t) dt = dt sinc(h) R(theta + h) with h = omega dt / 2. The motion is
    the chord of an arc, in the direction of the body at dt / 2. theta is not wrapped.
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


@entry("int64, int64, float64, float64, float64, float64, out float64[:, ::1], float64[:, ::1]")
def turn_steering_angle(row, velocity, wheelbase, limit, rate, dt, q, v):
    """Turn the steering angle q[row, b] of a car towards the angle of the velocity (v, omega).

    The target angle is atan(wheelbase omega/v) within the limit. The angle changes by at most
    rate |dt|. A car at rest keeps its angle.
    """
    step = rate * abs(dt)
    for b in range(q.shape[1]):
        speed, turn_rate, angle = v[velocity, b], v[velocity + 1, b], q[row, b]
        if speed != 0.0:
            target = math.atan(wheelbase * turn_rate / speed)
            target = min(max(target, -limit), limit)
            angle += min(max(target - angle, -step), step)
        q[row, b] = angle


@entry("int64, int64, float64, float64[:, ::1], out float64[:, ::1]")
def set_yaw_rate(row, velocity, wheelbase, q, v):
    """Replace omega of a car by the yaw rate of its steering angle, v tan(angle)/wheelbase."""
    for b in range(q.shape[1]):
        v[velocity + 1, b] = v[velocity, b] * math.tan(q[row, b]) / wheelbase
