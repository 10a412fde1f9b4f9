"""Inverse kinematics in closed form, with all solutions, of arms whose axes allow it.

Axis 1 is square to axis 2, and axis 3 parallel to it. Then either axes 4, 5, 6 meet in one point,
4 and 6 square to 5 (a spherical wrist: D. L. Pieper, The kinematics of manipulators under computer
control, 1968; R. P. Paul and H. Zhang, Computationally efficient kinematics for manipulators with
spherical wrists, Int. J. Robotics Research 5(2), 1986), or axis 4 is parallel to 2 and 3 too, axis
5 is square to it, and there are no more (R. J. Schilling, Fundamentals of Robotics, 1990, section
3.5: the Rhino).

All quantities are in the axes that joint 1 carries: z along axis 1, y along axis 2. In their plane
x, z a point is the complex number z + i x, so a turn by t about y is the factor exp(i t).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, positive, runs_last
from robsim.base.errors import InputError
from robsim.base.values import Value
from robsim.geometry.pose import as_pose, homogeneous
from robsim.robot.ik.numeric import Arm
from robsim.robot.joint import LIMIT_SLACK

TRUE = 1e-9  # metres or radians by which axes may deviate from such a geometry
ROUNDING = 1e-12  # by which a sine or cosine may exceed 1 where an arm is fully stretched


@dataclass(frozen=True, eq=False)
class ClosedIK(Value):
    """All coordinates that bring an arm to a pose, with NaN for solutions that do not exist.

    q       (..., n, nq), each angle within its limits if a whole turn can bring it there
    valid   (..., n) whether there is the solution: forward kinematics gives the pose
    within  (..., n) whether it is within the limits too

    A spherical wrist has n = 8, and the index is 4 shoulder + 2 elbow + wrist, each 0 or 1: the
    arm ahead or turned about and leaning back, the elbow on either side, the wrist flipped. An arm
    of five joints has n = 4, without the wrist.

    >>> from robsim.files import robots
    >>> puma = robots.puma560()
    >>> found = puma.closed_ik(puma.fk(puma.home))
    >>> int(found.valid.sum()), int(found.within.sum())
    (8, 2)
    """

    q: Array
    valid: NDArray[np.bool_]
    within: NDArray[np.bool_]


@dataclass(frozen=True)
class _Axes:
    """The joint axes at q = 0: h (n, 3) along them, p (n, 3) on them, and T of the link."""

    h: Array
    p: Array
    T: Array
    rows: NDArray[np.int64]  # of the coordinates


def solve_closed(arm: Arm, T: object, tolerance: float) -> ClosedIK:
    """Return all solutions for poses T (..., 4, 4) of the link in the base.

    InputError: T is no pose; the arm has no closed form that is known here, and why.
    """
    pose, off = as_pose(T).matrix, positive(tolerance, "tolerance (metres and radians)")
    axes = _axes(arm)
    centre = _check(axes, arm.link)
    goals = pose.reshape(-1, 4, 4)
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN marks solutions that do not exist
        angles = _angles(axes, centre, goals)
    q = np.broadcast_to(arm.home, (*angles.shape[:2], len(arm.home))).copy()
    q[..., axes.rows] = _folded(angles, arm.limits[axes.rows])
    valid = _reaches(arm, q, goals, off)
    q[~valid] = np.nan
    low, high = arm.limits.T
    with np.errstate(invalid="ignore"):
        within = valid & ((q >= low - LIMIT_SLACK) & (q <= high + LIMIT_SLACK)).all(axis=-1)
    lead = (*pose.shape[:-2], angles.shape[1])
    return ClosedIK(
        frozen(q.reshape(*lead, len(arm.home))),
        frozen(valid.reshape(lead)),
        frozen(within.reshape(lead)),
    )


def _axes(arm: Arm) -> _Axes:
    """Return the axes of the joints that carry the link, from the base on.

    InputError: one of these joints is not revolute.
    """
    tree = arm.tree
    columns = np.flatnonzero(tree.carries(arm.link))
    columns = columns[np.argsort(tree.owners[columns])]
    if len(columns) not in (5, 6) or not all(kind.turns for kind in tree.kinds(columns)):
        raise _no(arm.link, f"five or six revolute joints carry it, not {len(columns)} velocities")
    if np.isin(tree.velocity, columns).sum() != len(columns):
        raise _no(arm.link, "no joint follows another")
    rows, q = tree.alone(columns), arm.home.copy()
    q[rows] = 0.0
    bodies = tree.bodies(q[:, None])
    poses = bodies.poses[tree.owners[columns], :, :, 0]
    T = homogeneous(tree.frame(bodies, arm.link))[0]
    return _Axes(poses[:, :, 2], poses[:, :, 3], T, rows)


def _check(axes: _Axes, link: str) -> Array:
    """Return the point that joints 4 and up leave in place; raise InputError for other arms."""
    h, p = axes.h, axes.p
    if not _is_square(h[0], h[1]):
        raise _no(link, "axis 2 is square to axis 1")
    if not _is_parallel(h[1], h[2]):
        raise _no(link, "axis 3 is parallel to axis 2")
    if len(h) == 5:
        if not _is_parallel(h[1], h[3]):
            raise _no(link, "axis 4 of an arm of five joints is parallel to axes 2 and 3")
        if not _is_square(h[3], h[4]):
            raise _no(link, "axis 5 is square to axis 4")
        return np.asarray(p[4])
    if not (_is_square(h[3], h[4]) and _is_square(h[4], h[5])):
        raise _no(link, "axes 4 and 6 are square to axis 5")
    centre = np.asarray(p[3] + h[3] * (h[3] @ (p[4] - p[3])))  # of axis 4, nearest to axis 5
    apart = max(float(np.linalg.norm(np.cross(centre - p[i], h[i]))) for i in (4, 5))
    if apart > TRUE:
        raise _no(link, f"axes 4, 5 and 6 meet in one point: they miss it by {apart:.3g} m")
    return centre


def _no(link: str, needs: str) -> InputError:
    return InputError(
        f"no closed form is known for link '{link}': it would need that {needs}; robot.ik "
        "searches for coordinates of any arm"
    )


def _is_square(a: Array, b: Array) -> bool:
    return bool(abs(a @ b) < TRUE)


def _is_parallel(a: Array, b: Array) -> bool:
    return bool(np.linalg.norm(np.cross(a, b)) < TRUE)


def _angles(axes: _Axes, centre: Array, goals: Array) -> Array:
    """Return the angles (b, solutions, n) of all branches; NaN, or wrong, where there is none."""
    h, p = axes.h, axes.p
    base = np.stack([np.cross(h[1], h[0]), h[1], h[0]])  # rows: x, y, z that joint 1 carries
    turned = goals[:, :3, :3] @ axes.T[:3, :3].T  # rotation from the link's orientation at q = 0
    at = np.einsum("bij,j->bi", turned, centre - axes.T[:3, 3]) + goals[:, :3, 3]
    C, c = (at - p[0]) @ base.T, base @ (centre - p[0])  # at the pose, and at q = 0
    A, B = _planar(base @ (p[1] - p[0])), _planar(base @ (p[2] - p[0]))
    spare = turned @ h[4] @ base.T if len(h) == 5 else np.zeros_like(C)
    found = []
    for shoulder in (0, 1):
        q1 = _base_angle(C, c[1], spare, shoulder)
        rest = _about_z(-q1) @ base @ turned  # the rotation left to the other joints, in x, y, z
        along = _planar(np.einsum("bij,bj->bi", _about_z(-q1), C)) - A
        for elbow in (0, 1):
            if len(h) == 5:
                found.append(_five(axes, base, (q1, along, rest), (A, B, c), elbow))
            else:
                found += _six(axes, base, (q1, along, rest), (B - A, _planar(c) - B), elbow)
    return np.stack(found, axis=1)


def _planar(x: Array) -> Array:
    return np.asarray(x[..., 2] + 1j * x[..., 0])


def _base_angle(C: Array, aside: float, spare: Array, shoulder: int) -> Array:
    """Return q1 that brings the plane of the arm, `aside` of axis 1, to the point C (b, 3).

    Every plane through axis 1 holds a point on it: then the direction `spare` (b, 3) is brought
    into the plane, and where this is zero, or along the axis too, q1 is 0 or half a turn.
    """
    away, level = np.hypot(C[:, 0], C[:, 1]), np.hypot(spare[:, 0], spare[:, 1])
    on_axis = (away <= TRUE) & (abs(aside) <= TRUE)
    lean = np.where(on_axis, 0.0, np.arcsin(_unit(aside / away)))
    turn = np.where(level > TRUE, np.arctan2(spare[:, 1], spare[:, 0]), 0.0)
    turn = np.where(on_axis, turn, np.arctan2(C[:, 1], C[:, 0]))
    return np.asarray(turn - (np.pi - lean if shoulder else lean))


def _two_bars(along: Array, u: Array, w: Array, elbow: int) -> tuple[Array, Array]:
    """Return t2, t3 with exp(i t2) (u + exp(i t3) w) = along, by the law of cosines."""
    square = np.abs(along) ** 2 - np.abs(u) ** 2 - np.abs(w) ** 2
    bend = np.arccos(_unit(square / (2.0 * np.abs(u) * np.abs(w))))
    t3 = np.angle(u) - np.angle(w) + (-bend if elbow else bend)
    return np.angle(along) - np.angle(u + np.exp(1j * t3) * w), t3


def _five(
    axes: _Axes,
    base: Array,
    given: tuple[Array, Array, Array],
    zero: tuple[Array, Array, Array],
    elbow: int,
) -> Array:
    """Return angles (b, 5): the pitch of axis 5 gives axis 4, and that the two bars."""
    (q1, along, rest), (A, B, c) = given, zero
    h, s = axes.h, axes.h[1:4] @ axes.h[1]  # +-1
    D = _planar(base @ (axes.p[3] - axes.p[0]))
    pitch = np.angle(_planar(rest @ h[4])) - np.angle(_planar(base @ h[4]))
    t2, t3 = _two_bars(along - np.exp(1j * pitch) * (_planar(c) - D), B - A, D - B, elbow)
    roll = np.swapaxes(_about_y(pitch), 1, 2) @ rest
    q5 = _angle_about(base @ h[4], base @ h[3], roll @ h[3])
    return np.stack([q1, t2, s[1] * t3, s[2] * (pitch - t2 - t3), q5], axis=1)


def _six(
    axes: _Axes,
    base: Array,
    given: tuple[Array, Array, Array],
    bars: tuple[Array, Array],
    elbow: int,
) -> list[Array]:
    """Return two sets of angles (b, 6): with the wrist and with the flipped wrist.

    What is left to the wrist is M = E4 E5 E6. The angle from axis 4 to M h6 gives q5, the way
    round axis 4 gives q4, and what E6 does to axis 5 gives q6.
    """
    q1, along, rest = given
    h4, h5, h6 = axes.h[3:] @ base.T
    t2, t3 = _two_bars(along, *bars, elbow)
    M = np.swapaxes(_about_y(t2 + t3), 1, 2) @ rest @ base.T
    aim, side = M @ h6, np.cross(h5, h4)
    across = np.hypot(aim @ side, aim @ np.cross(h4, side))
    zero = np.arctan2(h6 @ side, h6 @ h4)
    found = []
    for sign in (1.0, -1.0):
        q5 = np.arctan2(sign * across, aim @ h4) - zero
        q4 = np.arctan2(sign * (aim @ np.cross(h4, side)), sign * (aim @ side))
        q4 = np.where(across > ROUNDING, q4, 0.0)  # axes 4 and 6 coincide: their sum counts
        left = _about(h5, -q5) @ _about(h4, -q4) @ M
        q6 = _angle_about(h6, h5, left @ h5)
        q3 = t3 * (axes.h[1] @ axes.h[2])
        found.append(np.stack([q1, t2, q3, q4, q5, q6], axis=1))
    return found


def _unit(x: Array) -> Array:
    """Return a cosine clipped to [-1, 1], or NaN if it is outside by more than rounding."""
    clipped = np.clip(x, -1.0, 1.0)
    return np.where(np.abs(x) <= 1.0 + ROUNDING, clipped, np.nan)


def _angle_about(axis: Array, start: Array, end: Array) -> Array:
    """Return the angle about `axis` from `start`, perpendicular to it, to `end` (b, 3)."""
    return np.asarray(np.arctan2(end @ np.cross(axis, start), end @ start))


def _about(axis: Array, angle: Array) -> Array:
    """Return rotations (b, 3, 3) by angle (b,): I + sin [a]x + (1 - cos) [a]x^2 (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * K + (1.0 - c) * (K @ K))


def _about_y(angle: Array) -> Array:
    return _about(np.array([0.0, 1.0, 0.0]), angle)


def _about_z(angle: Array) -> Array:
    return _about(np.array([0.0, 0.0, 1.0]), angle)


def _folded(angles: Array, limits: Array) -> Array:
    """Return angles in (-pi, pi], or a full turn away where only this is within the limits."""
    turn = 2.0 * np.pi
    q = angles - turn * np.round(angles / turn)
    low, high = limits[:, 0] - LIMIT_SLACK, limits[:, 1] + LIMIT_SLACK
    up, down = q < low, q > high
    q = np.where(up & (q + turn <= high), q + turn, q)
    return np.where(down & (q - turn >= low), q - turn, q)


def _reaches(arm: Arm, q: Array, goals: Array, tolerance: float) -> NDArray[np.bool_]:
    """Return whether (b, solutions) forward kinematics of q gives the pose."""
    flat = np.nan_to_num(runs_last(q, 1))
    T = homogeneous(arm.tree.frame(arm.tree.bodies(flat), arm.link), q.shape[:-1])
    off = np.abs(T - goals[:, None])[..., :3, :].max(axis=(-1, -2))
    return np.asarray(np.isfinite(q).all(axis=-1) & (off <= tolerance))
