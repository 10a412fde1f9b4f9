"""The motions of the kinds of joint: poses in place, and exact integration of held velocities.

A kind of the user's own is OWN: Python has written its motion where its pose will be.
"""

import math

import numpy as np

from robsim.kernels import curve, se3
from robsim.kernels.jit import kernel, part

REVOLUTE, PRISMATIC, FLOATING, PLANAR, UNICYCLE, CAR, RAIL, OWN = 1, 2, 3, 4, 5, 6, 7, 8


@kernel
def turn(angle, T):
    """Replace T by T Rz(angle), in place."""
    c, s = np.empty_like(angle), np.empty_like(angle)
    for b in range(angle.size):
        c[b], s[b] = math.cos(angle[b]), math.sin(angle[b])
    for r in range(3):
        for b in range(angle.size):
            x, y = T[r, 0, b], T[r, 1, b]
            T[r, 0, b] = c[b] * x + s[b] * y
            T[r, 1, b] = c[b] * y - s[b] * x


@part
def slide(distance, T):
    """Replace T by T Tz(distance), in place."""
    for r in range(3):
        for b in range(distance.size):
            T[r, 3, b] += T[r, 2, b] * distance[b]


@kernel
def fly(q, T):
    """Replace T by T [R | p] with q[7, b] = (p, unit quaternion x y z w), in place."""
    for b in range(q.shape[1]):
        R0, R1, R2 = se3.quaternion_to_rotation(q[3, b], q[4, b], q[5, b], q[6, b])
        for r in range(3):
            x, y, z = T[r, 0, b], T[r, 1, b], T[r, 2, b]
            T[r, 3, b] += x * q[0, b] + y * q[1, b] + z * q[2, b]
            T[r, 0, b] = x * R0[0] + y * R1[0] + z * R2[0]
            T[r, 1, b] = x * R0[1] + y * R1[1] + z * R2[1]
            T[r, 2, b] = x * R0[2] + y * R1[2] + z * R2[2]


@part
def glide(q, T):
    """Replace T by T Tx(x) Ty(y) Rz(theta) with q[3, b] = (x, y, theta), in place."""
    for r in range(3):
        for b in range(q.shape[1]):
            T[r, 3, b] += T[r, 0, b] * q[0, b] + T[r, 1, b] * q[1, b]
    turn(q[2], T)


@kernel
def ride(curves, which, s, T, bend):
    """Replace T by T C(s), in place, with C the frame on a curve, whose curvature is bend[b]."""
    for b in range(s.size):
        x, y, c, d, bend[b] = curve.point(curves, which, s[b])
        for r in range(3):
            X, Y = T[r, 0, b], T[r, 1, b]
            T[r, 3, b] += X * x + Y * y
            T[r, 0, b] = c * X + d * Y
            T[r, 1, b] = c * Y - d * X


@kernel
def carry(above, place, T):
    """Replace the motion in T[3, 4, b] by above place T, in place."""
    start, motion = np.empty_like(T), T.copy()
    se3.compose_constant(above, place, start)
    se3.compose(start, motion, T)


@kernel
def integrate_floating(v, dt, q):
    """Replace q of a pose T by that of T exp(V dt), for a body twist V = (v, omega)."""
    for b in range(q.shape[1]):
        V = (dt * v[0, b], dt * v[1, b], dt * v[2, b], dt * v[3, b], dt * v[4, b], dt * v[5, b])
        p = se3.exp_translation(V[0], V[1], V[2], V[3], V[4], V[5])
        R = se3.quaternion_to_rotation(q[3, b], q[4, b], q[5, b], q[6, b])
        for r in range(3):
            q[r, b] += R[r][0] * p[0] + R[r][1] * p[1] + R[r][2] * p[2]
        x, y, z, w = se3.exp_quaternion(V[3], V[4], V[5])
        x, y, z, w = se3.quaternion_product(q[3, b], q[4, b], q[5, b], q[6, b], x, y, z, w)
        norm = math.sqrt(x * x + y * y + z * z + w * w)
        q[3, b], q[4, b], q[5, b], q[6, b] = x / norm, y / norm, z / norm, w / norm


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
def steer(row, velocity, wheelbase, limit, rate, dt, q, v):
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
def obey(row, velocity, wheelbase, q, v):
    """Replace omega of a car by that of its steering angle: v tan(angle)/wheelbase."""
    for b in range(q.shape[1]):
        v[velocity + 1, b] = v[velocity, b] * math.tan(q[row, b]) / wheelbase
