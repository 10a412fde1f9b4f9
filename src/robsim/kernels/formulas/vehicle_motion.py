"""Exact motion of vehicles with constant velocities."""

import math

from robsim.kernels.formulas.lane_math import cos_sin
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import where


@part
def chord_in_plane(theta, vx, vy, omega, dt):
    """Return the motion (x, y) on lanes of a body with constant velocities over dt, from theta on.

    int_0^dt R(theta + omega t) dt = dt sinc(h) R(theta + h) with h = omega dt / 2. The motion is
    the chord of an arc, in the direction of the body at dt / 2.
    """
    half = 0.5 * dt * omega
    _, sine = cos_sin(half)
    is_straight = half == 0.0
    chord = dt * where(is_straight, 1.0, sine / where(is_straight, 1.0, half))
    c, s = cos_sin(theta + half)
    return chord * c * vx - chord * s * vy, chord * s * vx + chord * c * vy


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
