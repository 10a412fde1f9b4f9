"""The kinematic tree: poses of its moving bodies, Jacobians, and the motion of held velocities.

A joint is `place . motion(q) . tail`. Tails and fixed joints are folded into constants before
they come here (see `robsim.tree`), so a moving body i has a parent body, a constant `place`, a
kind, and its first coordinate `iq`. A velocity j of the tree moves body `body[j]` along or about
axis `axis[j]` of that body's own frame: prismatic and revolute joints have one such velocity,
floating joints six, planar joints three, unicycles two.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import se3
from robsim.kernels.jit import kernel, part

REVOLUTE, PRISMATIC, FLOATING, PLANAR, UNICYCLE = 1, 2, 3, 4, 5


class Joints(NamedTuple):
    """The constants of a tree, body by body; body 0 is the world."""

    parent: Any
    kind: Any
    iq: Any  # first coordinate
    iv: Any  # first velocity
    place: Any  # (bodies, 3, 4)


class Moves(NamedTuple):
    """Some velocities of a tree: which, what they move and how, and with which sign."""

    columns: Any
    body: Any
    angular: Any
    axis: Any
    sign: Any


@kernel
def turn(angle, T):
    """T <- T Rz(angle), in place."""
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
    """T <- T Tz(distance), in place."""
    for r in range(3):
        for b in range(distance.size):
            T[r, 3, b] += T[r, 2, b] * distance[b]


@kernel
def fly(q, T):
    """T <- T [R | p] with q[7, b] = (p, unit quaternion x y z w), in place."""
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
    """T <- T Tx(x) Ty(y) Rz(theta) with q[3, b] = (x, y, theta), in place."""
    for r in range(3):
        for b in range(q.shape[1]):
            T[r, 3, b] += T[r, 0, b] * q[0, b] + T[r, 1, b] * q[1, b]
    turn(q[2], T)


@kernel
def bodies(parent, kind, iq, place, q, M):
    """Poses M[i, 3, 4, b] in the world of all bodies; parents come before their children."""
    for r in range(3):
        for c in range(4):
            for b in range(q.shape[1]):
                M[0, r, c, b] = 1.0 if r == c else 0.0
    for i in range(1, M.shape[0]):
        se3.compose_constant(M[parent[i]], place[i], M[i])
        if kind[i] == REVOLUTE:
            turn(q[iq[i]], M[i])
        elif kind[i] == PRISMATIC:
            slide(q[iq[i]], M[i])
        elif kind[i] == FLOATING:
            fly(q[iq[i] : iq[i] + 7], M[i])
        else:
            glide(q[iq[i] : iq[i] + 3], M[i])


@kernel
def frame(M, body, offset, T):
    """T[3, 4, b] of a frame that rides on a body at a constant offset."""
    se3.compose_constant(M[body], offset, T)


@kernel
def jacobian(M, point, body, angular, axis, sign, J):
    """J[6, j, b] of a frame at point[3, b], rows (v, omega) in world axes.

    `sign[j]` is 1 where velocity j carries the frame and 0 where not; for the motion of one
    frame relative to another it is the difference of the two, both taken at the same point.
    An axis a through o gives v = a x (p - o), omega = a; a slide along a gives v = a.
    """
    for j in range(sign.size):
        i, c, s = body[j], axis[j], float(sign[j])
        for r in range(3):
            u, w = (r + 1) % 3, (r + 2) % 3
            for b in range(M.shape[3]):
                if angular[j]:
                    J[r, j, b] = s * (
                        M[i, u, c, b] * (point[w, b] - M[i, w, 3, b])
                        - M[i, w, c, b] * (point[u, b] - M[i, u, 3, b])
                    )
                    J[r + 3, j, b] = s * M[i, r, c, b]
                else:
                    J[r, j, b] = s * M[i, r, c, b]
                    J[r + 3, j, b] = 0.0


@kernel
def into_axes(T, J, out):
    """out[6, j, b] = both halves of J turned from world axes into the axes of T."""
    for half in range(0, 6, 3):
        for j in range(J.shape[1]):
            for r in range(3):
                for b in range(J.shape[2]):
                    out[half + r, j, b] = (
                        T[0, r, b] * J[half, j, b]
                        + T[1, r, b] * J[half + 1, j, b]
                        + T[2, r, b] * J[half + 2, j, b]
                    )


@kernel
def camera_jacobian(M, T_w_c, body, angular, axis, sign, J):
    """J_c - J_o[6, j, b] at the camera origin in camera axes, so that V_c - V_o = J qdot."""
    world = np.empty_like(J)
    jacobian(M, T_w_c[:, 3], body, angular, axis, sign, world)
    into_axes(T_w_c, world, J)


@kernel
def spread(columns, some, drift, qd):
    """qd[columns[j], b] = some[j, b], and drift[i] for the other velocities."""
    for i in range(qd.shape[0]):
        for b in range(qd.shape[1]):
            qd[i, b] = drift[i]
    for j in range(columns.size):
        for b in range(qd.shape[1]):
            qd[columns[j], b] = some[j, b]


@kernel
def integrate(kind, iq, iv, v, dt, q):
    """Q <- the coordinates after the velocity v[n, b] was held for dt: exact, in place."""
    for i in range(1, kind.size):
        n, m = iq[i], iv[i]
        if kind[i] == FLOATING:
            _integrate_floating(v[m : m + 6], dt, q[n : n + 7])
        elif kind[i] == PLANAR:
            _integrate_in_plane(v[m : m + 3], dt, q[n : n + 3])
        elif kind[i] == UNICYCLE:
            _integrate_in_plane(v[m : m + 2], dt, q[n : n + 3])
        else:
            for b in range(q.shape[1]):
                q[n, b] += dt * v[m, b]


@kernel
def _integrate_floating(v, dt, q):
    """T <- T exp(V dt) for the body twist V = (v, omega) held over dt."""
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
def _integrate_in_plane(v, dt, q):
    """The arc of a held velocity (vx, vy, omega), or (v, omega) where vy is zero: a unicycle.

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
