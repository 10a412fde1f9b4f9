"""The kinematic tree: poses of its moving bodies, Jacobians, and the motion of held velocities.

A joint is `place . motion(x) . tail`. Tails and fixed joints are folded into constants before
they come here (see `robsim.tree`), so a moving body i has a parent body, a constant `place`, a
kind, and its first coordinate `ix` among x: those of the tree, q, then those that depend on them.

A velocity of the tree moves one or several bodies: each such move is along or about an axis of
that body's own frame, times a ratio. Ratio 0 is 1; the others are derivatives of coordinates that
depend on others, curvatures of rails, and what turns the wheels of vehicles.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import curve, se3
from robsim.kernels.jit import kernel, part

REVOLUTE, PRISMATIC, FLOATING, PLANAR, UNICYCLE, CAR, RAIL = 1, 2, 3, 4, 5, 6, 7
MIMIC, CHORD, ACKERMANN = 0, 1, 2


# Integers stand in tables, because each array that a kernel is given costs time: columns of
# `Joints.rows`
PARENT, KIND, IX, IQ, IV, CURVE, BEND = range(7)


class Ties(NamedTuple):
    """Coordinates that depend on one other, in an order in which that comes before."""

    # (ties, 5): MIMIC, CHORD or ACKERMANN; row of x that it depends on; row of the ratio that is
    # its derivative by the velocity of its root; of a chord its curve, and what it gives
    rows: Any
    # (ties, 3) MIMIC: ratio, offset. CHORD: length, radius, at. ACKERMANN: wheelbase, x, y
    numbers: Any


class Wheels(NamedTuple):
    """Wheels that roll under their vehicle; the hub stands at (x, y) of it."""

    # (wheels, 4): row of their angle in q; v of the vehicle, omega is the next; row of x by whose
    # angle the wheel is turned, or -1; ratio of what v adds to its speed, that of omega is the next
    rows: Any
    numbers: Any  # (wheels, 3): radius, x, y


class Joints(NamedTuple):
    """The constants of a tree, body by body; body 0 is the world."""

    # (bodies, 7): parent; kind; first coordinate among x; the same where it is one of the tree's
    # own, or -1; first velocity, or -1; the curve of a rail; row of its curvature among the ratios
    rows: Any
    place: Any  # (bodies, 3, 4)
    ties: Ties
    wheels: Wheels
    curves: curve.Curves
    ratios: int  # how many


class Bodies(NamedTuple):
    """Where the moving bodies are, and by which ratios velocities move them; the run last."""

    poses: Any  # (bodies, 3, 4, B) in the world
    ratio: Any  # (ratios, B)


class Moves(NamedTuple):
    """What some velocities of a tree move: one row for each body that each of them moves."""

    columns: Any  # the velocities
    # (moves, 5): the number of its velocity among them, in order; body, whether it turns, axis,
    # row of its ratio. One table, because each array that a kernel is given costs time
    rows: Any
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
def ride(curves, which, s, T, bend):
    """T <- T C(s), in place, where C is the frame that rides on a curve; its curvature bend[b]."""
    for b in range(s.size):
        x, y, c, d, bend[b] = curve.point(curves, which, s[b])
        for r in range(3):
            X, Y = T[r, 0, b], T[r, 1, b]
            T[r, 3, b] += X * x + Y * y
            T[r, 0, b] = c * X + d * Y
            T[r, 1, b] = c * Y - d * X


@kernel
def steered(angle, wheelbase, x, y):
    """Angle of a wheel at (x, y) of a car, and its derivative by the steering angle.

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
    """What v and omega of a vehicle add to the speeds of its wheels, rad/s for each of them.

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


@part
def _world(T):
    """T <- the identity."""
    for r in range(3):
        for c in range(4):
            for b in range(T.shape[2]):
                T[r, c, b] = 1.0 if r == c else 0.0


@kernel
def _place(rows, place, curves, x, out):
    """Poses of all bodies from coordinates x; parents come before their children."""
    poses = out.poses
    _world(poses[0])
    for i in range(1, poses.shape[0]):
        parent, kind, ix, _, _, which, bend = rows[i]
        se3.compose_constant(poses[parent], place[i], poses[i])
        if kind == REVOLUTE:
            turn(x[ix], poses[i])
        elif kind == PRISMATIC:
            slide(x[ix], poses[i])
        elif kind == FLOATING:
            fly(x[ix : ix + 7], poses[i])
        elif kind == RAIL:
            ride(curves, which, x[ix], poses[i], out.ratio[bend])
        else:
            glide(x[ix : ix + 3], poses[i])


@kernel
def _extend(joints, q, ratio):
    """All coordinates x[:, b]: q, and those that follow it; and the ratios but for curvatures."""
    x = np.empty((q.shape[0] + joints.ties.rows.shape[0], q.shape[1]))
    for i in range(q.shape[0]):
        for b in range(q.shape[1]):
            x[i, b] = q[i, b]
    depend(joints.ties, joints.curves, x, ratio)
    spin(joints.wheels, x, ratio)
    return x


@part
def _bend_further(rows, ties, own, ratio):
    """Curvature is per metre of a rail; of one that follows others, per unit of theirs."""
    for i in range(1, rows.shape[0]):
        if rows[i, KIND] == RAIL and rows[i, IX] >= own:
            bend, slope = rows[i, BEND], ties.rows[rows[i, IX] - own, 2]
            for b in range(ratio.shape[1]):
                ratio[bend, b] *= ratio[slope, b]


@kernel
def bodies(joints, q, out):
    """Fill `out` for coordinates q[n, b]."""
    for b in range(q.shape[1]):
        out.ratio[0, b] = 1.0
    if joints.ratios == 1:  # no velocity moves anything but its own body
        _place(joints.rows, joints.place, joints.curves, q, out)
    else:
        x = _extend(joints, q, out.ratio)
        _place(joints.rows, joints.place, joints.curves, x, out)
        _bend_further(joints.rows, joints.ties, q.shape[0], out.ratio)


@kernel
def frame(poses, body, offset, T):
    """T[3, 4, b] of a frame that rides on a body at a constant offset."""
    se3.compose_constant(poses[body], offset, T)


@kernel
def jacobian(bodies, point, moves, J):
    """J[6, j, b] of a frame at point[3, b], rows (v, omega) in world axes.

    `sign` is 1 where a move carries the frame and 0 where not; for the motion of one frame
    relative to another it is the difference of the two, both taken at the same point.
    An axis a through o gives v = a x (p - o), omega = a; a slide along a gives v = a.
    """
    M = bodies.poses
    for m in range(moves.sign.size):
        j, i, turns, c, k = moves.rows[m]
        s, more = float(moves.sign[m]), m > 0 and moves.rows[m - 1, 0] == j
        for r in range(3):
            u, w = (r + 1) % 3, (r + 2) % 3
            for b in range(M.shape[3]):
                ratio = s * bodies.ratio[k, b]
                if turns:
                    v = ratio * (
                        M[i, u, c, b] * (point[w, b] - M[i, w, 3, b])
                        - M[i, w, c, b] * (point[u, b] - M[i, u, 3, b])
                    )
                    omega = ratio * M[i, r, c, b]
                else:
                    v, omega = ratio * M[i, r, c, b], 0.0
                J[r, j, b] = J[r, j, b] + v if more else v
                J[r + 3, j, b] = J[r + 3, j, b] + omega if more else omega


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
def camera_jacobian(bodies, T_w_c, moves, J):
    """J_c - J_o[6, j, b] at the camera origin in camera axes, so that V_c - V_o = J qdot."""
    world = np.empty_like(J)
    jacobian(bodies, T_w_c[:, 3], moves, world)
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


@part
def integrate(joints, v, dt, q):
    """Q <- the coordinates after the velocity v[n, b] was held for dt: exact, in place."""
    _integrate(joints.rows, v, dt, q)
    if joints.ratios > 1:  # there may be wheels of vehicles
        _roll(joints, v, dt, q)


@kernel
def _integrate(rows, v, dt, q):
    for i in range(1, rows.shape[0]):
        _, kind, _, n, m, _, _ = rows[i]
        if m < 0:
            continue  # what depends on others moves with them
        if kind == FLOATING:
            _integrate_floating(v[m : m + 6], dt, q[n : n + 7])
        elif kind == PLANAR:
            _integrate_in_plane(v[m : m + 3], dt, q[n : n + 3])
        elif kind in (UNICYCLE, CAR):
            _integrate_in_plane(v[m : m + 2], dt, q[n : n + 3])
        else:
            for b in range(q.shape[1]):
                q[n, b] += dt * v[m, b]


@kernel
def _roll(joints, v, dt, q):
    """The angles of the wheels of vehicles, whose speeds are constant along an arc."""
    wheels, ratio = joints.wheels, np.ones((joints.ratios, q.shape[1]))
    _extend(joints, q, ratio)
    for i in range(wheels.rows.shape[0]):
        n, m, _, k = wheels.rows[i]
        for b in range(q.shape[1]):
            q[n, b] += dt * (ratio[k, b] * v[m, b] + ratio[k + 1, b] * v[m + 1, b])


@kernel
def steer(row, velocity, wheelbase, limit, rate, dt, q, v):
    """The steering angle q[row, b] of a car goes where the omega in v asks for.

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
    """Omega of a car as its speed and its steering angle give it: v tan(angle)/wheelbase."""
    for b in range(q.shape[1]):
        v[velocity + 1, b] = v[velocity, b] * math.tan(q[row, b]) / wheelbase


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
