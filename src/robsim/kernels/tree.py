"""The kinematic tree: poses of its moving bodies, and the integration of held velocities.

A joint is `place . motion(x) . tail`. Tails and fixed joints are folded into constants before
they come here (see `robsim.robot.tree`), so a moving body i has a parent body, a constant `place`,
a kind, and its first coordinate `ix` among x: those of the tree, q, then those that depend on them.
"""

from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import curve, se3
from robsim.kernels.jit import kernel, part
from robsim.kernels.joints import (
    CAR,
    FLOATING,
    OWN,
    PLANAR,
    PRISMATIC,
    RAIL,
    REVOLUTE,
    UNICYCLE,
    carry,
    fly,
    glide,
    integrate_floating,
    integrate_in_plane,
    ride,
    slide,
    turn,
)
from robsim.kernels.ties import Ties, Wheels, depend, spin

# Integers stand in tables, because each array that a kernel is given costs time: columns of
# `Joints.rows`
PARENT, KIND, IX, IQ, IV, CURVE, BEND = range(7)


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
    """The poses of the moving bodies, and the ratios by which velocities move them; run last."""

    poses: Any  # (bodies, 3, 4, B) in the world
    ratio: Any  # (ratios, B)


@part
def _world(T):
    """Set T to the identity."""
    for r in range(3):
        for c in range(4):
            for b in range(T.shape[2]):
                T[r, c, b] = 1.0 if r == c else 0.0


@kernel
def _place(rows, place, curves, x, out):
    """Compute the poses of all bodies from coordinates x; parents come before their children."""
    poses = out.poses
    _world(poses[0])
    for i in range(1, poses.shape[0]):
        parent, kind, ix, _, _, which, bend = rows[i]
        if kind == OWN:
            carry(poses[parent], place[i], poses[i])
            continue
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
    """Compute all coordinates x[:, b], q and its followers, and the ratios but for curvatures."""
    x = np.empty((q.shape[0] + joints.ties.rows.shape[0], q.shape[1]))
    for i in range(q.shape[0]):
        for b in range(q.shape[1]):
            x[i, b] = q[i, b]
    depend(joints.ties, joints.curves, x, ratio)
    spin(joints.wheels, x, ratio)
    return x


@part
def _bend_further(rows, ties, own, ratio):
    """Scale curvatures, per metre of a rail, of rails that follow others to units of theirs."""
    for i in range(1, rows.shape[0]):
        if rows[i, KIND] == RAIL and rows[i, IX] >= own:
            bend, slope = rows[i, BEND], ties.rows[rows[i, IX] - own, 2]
            for b in range(ratio.shape[1]):
                ratio[bend, b] *= ratio[slope, b]


@kernel
def bodies(joints, q, out):
    """Fill `out` for coordinates q[n, b]; motions and twists of OWN joints are in it already."""
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
    """Compute T[3, 4, b] of a frame that rides on a body at a constant offset."""
    se3.compose_constant(poses[body], offset, T)


@part
def integrate(joints, v, dt, q):
    """Replace q by the coordinates after velocity v[n, b] was held for dt: exact, in place."""
    _integrate(joints.rows, v, dt, q)
    if joints.ratios > 1:  # there may be wheels of vehicles
        _roll(joints, v, dt, q)


@kernel
def _integrate(rows, v, dt, q):
    for i in range(1, rows.shape[0]):
        _, kind, _, n, m, _, _ = rows[i]
        if m < 0 or kind == OWN:
            continue  # what depends on others moves with them; Python moves joints of own kinds
        if kind == FLOATING:
            integrate_floating(v[m : m + 6], dt, q[n : n + 7])
        elif kind == PLANAR:
            integrate_in_plane(v[m : m + 3], dt, q[n : n + 3])
        elif kind in (UNICYCLE, CAR):
            integrate_in_plane(v[m : m + 2], dt, q[n : n + 3])
        else:
            for b in range(q.shape[1]):
                q[n, b] += dt * v[m, b]


@kernel
def _roll(joints, v, dt, q):
    """Add the rolling of vehicles' wheels to their angles; their speeds are constant on an arc."""
    wheels, ratio = joints.wheels, np.ones((joints.ratios, q.shape[1]))
    _extend(joints, q, ratio)
    for i in range(wheels.rows.shape[0]):
        n, m, _, k = wheels.rows[i]
        for b in range(q.shape[1]):
            q[n, b] += dt * (ratio[k, b] * v[m, b] + ratio[k + 1, b] * v[m + 1, b])
