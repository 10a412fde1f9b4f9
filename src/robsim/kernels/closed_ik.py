"""Inverse kinematics in closed form: all solutions of arms whose axes allow it, pose by pose.

What the arms and the angles are is said in `robsim.robot.ik.closed`. All quantities are in the axes
that joint 1 carries: z along axis 1, y along axis 2. In their plane x, z a point is the complex
number z + i x, so a turn by t about y is the factor exp(i t).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels import tree
from robsim.kernels.jit import kernel, part
from robsim.kernels.packed import unpack

TRUE = 1e-9  # metres or radians by which axes may deviate from such a geometry
ROUNDING = 1e-12  # by which a sine or cosine may exceed 1 where an arm is fully stretched
POSES = 8  # placed at once, with all their solutions
TURN = 2.0 * math.pi
Y, Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
NOWHERE = (0.0, 0.0, 0.0)


class Axes(NamedTuple):
    """The joint axes at q = 0, with c the point that joints 4 and up leave in place."""

    base: Any  # (3, 3) rows x, y, z of the axes that joint 1 carries, in the base
    origin: Any  # (3,) a point on axis 1, in the base
    tool: Any  # (3, 3) in the axes of the link: c, directions of the last axis and the one before
    wrist: Any  # (2 or 3, 3) directions of axis 4 and up
    # (4,) complex: from axis 1 to 2, 2 to 3, and 3 to c; with five joints 3 to 4, and 4 to c
    bars: Any
    signs: Any  # (2,) of the turns about axes 3 and 4 against those about axis 2
    aside: float  # c along y


@part
def _planar(v):
    return complex(v[2], v[0])


@part
def _phase(z):
    return math.atan2(z.imag, z.real)


@part
def _factor(angle):
    return complex(math.cos(angle), math.sin(angle))


@part
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def _times(A, v):
    return _dot(A[0], v), _dot(A[1], v), _dot(A[2], v)


@kernel
def _about(axis, angle, v):
    """Return v turned by an angle: v + sin a x v + (1 - cos) a x (a x v) (Rodrigues)."""
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    u = _cross(axis, v)
    w = _cross(axis, u)
    return v[0] + s * u[0] + c * w[0], v[1] + s * u[1] + c * w[1], v[2] + s * u[2] + c * w[2]


@part
def _angle_about(axis, start, end):
    """Return the angle about `axis` from `start`, perpendicular to it, to `end`."""
    return math.atan2(_dot(end, _cross(axis, start)), _dot(end, start))


@part
def _unit(x):
    """Return a cosine clipped to [-1, 1], or NaN if it is outside by more than rounding."""
    return min(max(x, -1.0), 1.0) if abs(x) <= 1.0 + ROUNDING else math.nan


@kernel
def _base_angle(C, aside, spare, shoulder):
    """Return q1 that brings the plane of the arm, `aside` of axis 1, to the point C.

    Every plane through axis 1 holds a point on it: then the direction `spare` is brought into the
    plane, and where this is zero, or along the axis too, q1 is 0 or half a turn.
    """
    away, lean, turn = math.hypot(C[0], C[1]), 0.0, 0.0
    if away > TRUE or abs(aside) > TRUE:
        lean, turn = math.asin(_unit(aside / away)), math.atan2(C[1], C[0])
    elif math.hypot(spare[0], spare[1]) > TRUE:
        turn = math.atan2(spare[1], spare[0])
    return turn - (math.pi - lean if shoulder else lean)


@kernel
def _two_bars(along, u, w, elbow):
    """Return t2, t3 with exp(i t2) (u + exp(i t3) w) = along, by the law of cosines."""
    square = abs(along) ** 2 - abs(u) ** 2 - abs(w) ** 2
    bend = math.acos(_unit(square / (2.0 * abs(u) * abs(w))))
    t3 = _phase(u) - _phase(w) + (-bend if elbow else bend)
    return _phase(along) - _phase(u + _factor(t3) * w), t3


@kernel
def _five(axes, given, elbow, q, k):
    """Fill q[k] of five joints: the pitch of axis 5 gives axis 4, and that the two bars."""
    along, last, before = given
    h4, h5 = axes.wrist[0], axes.wrist[1]
    pitch = _phase(_planar(last)) - _phase(_planar(h5))
    end = _factor(pitch) * axes.bars[3]
    t2, t3 = _two_bars(along - end, axes.bars[1], axes.bars[2], elbow)
    roll = _about(Y, -pitch, before)
    q[k, 1], q[k, 2], q[k, 3] = t2, axes.signs[0] * t3, axes.signs[1] * (pitch - t2 - t3)
    q[k, 4] = _angle_about(h5, h4, roll)


@kernel
def _six(axes, given, elbow, q, k):
    """Fill q[k] and q[k + 1] of six joints: with the wrist and with the flipped wrist.

    What is left to the wrist is M = E4 E5 E6. The angle from axis 4 to M h6 gives q5, the way
    round axis 4 gives q4, and what E6 does to axis 5 gives q6.
    """
    along, last, before = given
    h4, h5, h6 = axes.wrist[0], axes.wrist[1], axes.wrist[2]
    t2, t3 = _two_bars(along, axes.bars[1], axes.bars[2], elbow)
    aim, carried = _about(Y, -t2 - t3, last), _about(Y, -t2 - t3, before)
    side = _cross(h5, h4)
    up = _cross(h4, side)
    across = math.hypot(_dot(aim, side), _dot(aim, up))
    zero = math.atan2(_dot(h6, side), _dot(h6, h4))
    for flip in range(2):
        sign = -1.0 if flip else 1.0
        q5, q4 = math.atan2(sign * across, _dot(aim, h4)) - zero, 0.0
        if across > ROUNDING:  # else axes 4 and 6 coincide: their sum counts
            q4 = math.atan2(sign * _dot(aim, up), sign * _dot(aim, side))
        left = _about(h5, -q5, _about(h4, -q4, carried))
        q[k + flip, 1], q[k + flip, 2], q[k + flip, 3] = t2, t3 * axes.signs[0], q4
        q[k + flip, 4], q[k + flip, 5] = q5, _angle_about(h6, h5, left)


@kernel
def _branches(axes, goal, q):
    """Fill q[solution, n] with the angles of all branches; NaN, or wrong, where there is none."""
    five, most = q.shape[1] == 5, q.shape[0] // 4
    at = _times(goal, axes.tool[0])
    at = (
        at[0] + goal[0, 3] - axes.origin[0],
        at[1] + goal[1, 3] - axes.origin[1],
        at[2] + goal[2, 3] - axes.origin[2],
    )
    C = _times(axes.base, at)
    last = _times(axes.base, _times(goal, axes.tool[1]))
    before = _times(axes.base, _times(goal, axes.tool[2]))
    for shoulder in range(2):
        q1 = _base_angle(C, axes.aside, last if five else NOWHERE, shoulder)
        along = _planar(_about(Z, -q1, C)) - axes.bars[0]
        given = along, _about(Z, -q1, last), _about(Z, -q1, before)
        for elbow in range(2):
            k = most * (2 * shoulder + elbow)
            for i in range(k, k + most):
                q[i, 0] = q1
            if five:
                _five(axes, given, elbow, q, k)
            else:
                _six(axes, given, elbow, q, k)


@kernel
def _folded(angle, low, high):
    """Return an angle in (-pi, pi], or a full turn away where only this is within the limits."""
    x = angle - TURN * np.rint(angle / TURN)
    if x < low and x + TURN <= high:
        return x + TURN
    if x > high and x - TURN >= low:
        return x - TURN
    return x


@kernel
def _candidates(axes, goals, rows, bounds, home, each):
    """Return coordinates x[n, column] of `each` branch of every goal, one goal after another."""
    angles, x = np.empty((each, rows.size)), np.empty((home.size, goals.shape[0] * each))
    for i in range(home.size):
        x[i] = home[i]
    for b in range(goals.shape[0]):
        _branches(axes, goals[b], angles)
        for j in range(rows.size):
            low, high = bounds[rows[j], 0], bounds[rows[j], 1]
            for k in range(each):
                x[rows[j], b * each + k] = _folded(angles[k, j], low, high)
    return x


@kernel
def _placed(joints, body, offset, x):
    """Return the poses T[3, 4, column] of the link at coordinates x[n, column]."""
    poses, T = np.empty((joints.rows.shape[0], 3, 4, x.shape[1])), np.empty((3, 4, x.shape[1]))
    tree.bodies(joints, x, tree.Bodies(poses, np.empty((joints.ratios, x.shape[1]))))
    tree.frame(poses, body, offset, T)
    return T


@kernel
def _reaches(T, column, goal, tolerance):
    """Return whether a pose is the goal."""
    reaches = True
    for r in range(3):
        for c in range(4):
            reaches = reaches and abs(T[r, c, column] - goal[r, c]) <= tolerance
    return reaches


@kernel
def _put(x, column, bounds, valid, q):
    """Store a solution in q[n], or NaN if it is not valid; return whether it is within bounds."""
    within = valid
    for i in range(q.size):
        q[i] = x[i, column] if valid else math.nan
        within = within and bounds[i, 0] <= q[i] <= bounds[i, 1]
    return within


@kernel
def solve(
    integers,
    numbers,
    body,
    offset,
    base,
    origin,
    tool,
    wrist,
    bars,
    signs,
    aside,
    rows,
    bounds,
    home,
    tolerance,
    goals,
    q,
    valid,
    within,
):
    """Compute q[run, solution, n] for goals[run, 4, 4] of a link at `offset` on a body.

    `rows` are the coordinates of the joints that carry it; the others stay at home.
    """
    joints, axes = unpack(integers, numbers), Axes(base, origin, tool, wrist, bars, signs, aside)
    runs, each = valid.shape
    for start in range(0, runs, POSES):
        end = min(start + POSES, runs)
        x = _candidates(axes, goals[start:end], rows, bounds, home, each)
        T = _placed(joints, body, offset, x)
        for run in range(start, end):
            for k in range(each):
                column = (run - start) * each + k
                valid[run, k] = _reaches(T, column, goals[run], tolerance)
                within[run, k] = _put(x, column, bounds, valid[run, k], q[run, k])
