"""Inverse kinematics in closed form, with all solutions, for suitable arms.

Axis 1 must be perpendicular to axis 2, and axis 3 parallel to axis 2. There are two forms:

- Six joints with a spherical wrist: axes 4, 5 and 6 meet in one point, with axes 4 and 6
  perpendicular to axis 5 (D. L. Pieper, The kinematics of manipulators under computer control,
  1968; R. P. Paul and H. Zhang, Computationally efficient kinematics for manipulators with
  spherical wrists, Int. J. Robotics Research 5(2), 1986).
- Five joints: axis 4 is parallel to axes 2 and 3, and axis 5 is perpendicular to axis 4 (R. J.
  Schilling, Fundamentals of Robotics, 1990, section 3.5: the Rhino).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_positive, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.geometry.pose import as_pose, homogeneous_matrix
from robsim.kernels.inverse_kinematics import closed_ik as kernels
from robsim.kernels.inverse_kinematics.closed_ik import GEOMETRY_TOLERANCE
from robsim.kernels.machine.program import Program
from robsim.robot.fk_stages import FKStages
from robsim.robot.ik.arm import IKArm
from robsim.robot.joint import LIMIT_SLACK


@dataclass(frozen=True, eq=False)
class ClosedFormIK(Value):
    """All solutions of inverse kinematics in closed form.

    An arm with a spherical wrist has n = 8 solutions with the index 4 shoulder + 2 elbow + wrist,
    each 0 or 1. With shoulder 1, joint 1 faces away from the goal and the arm leans back. The elbow
    is on either side, and wrist 1 is flipped. An arm with five joints has n = 4 solutions with the
    index 2 shoulder + elbow.

    Attributes
    ----------
    q : ndarray of shape (..., n, nq)
        Coordinates in rad. Whole turns are added to bring an angle within its limits, if possible.
        NaN for solutions that do not exist.
    valid : ndarray of bool of shape (..., n)
        Whether the solution exists: forward kinematics gives the pose.
    within : ndarray of bool of shape (..., n)
        Whether the solution exists and is within the limits.

    Examples
    --------
    >>> from robsim.files import robots
    >>> puma = robots.puma560()
    >>> result = puma.closed_ik(puma.fk(puma.home))
    >>> int(result.valid.sum()), int(result.within.sum())
    (8, 2)
    """

    q: Array
    valid: NDArray[np.bool_]
    within: NDArray[np.bool_]


def solve_closed(arm: IKArm, T: object, tolerance: float) -> ClosedFormIK:
    """Return all solutions for poses T (..., 4, 4) of the link in the base.

    Raise InputError if T is no pose, or if the arm has no known closed form.
    """
    pose, deviation = as_pose(T).matrix, as_positive(tolerance, "tolerance (metres and radians)")
    if "closed form" not in arm.cache:
        arm.cache["closed form"] = _derive_closed_form(arm)
    goals = make_read_only(pose.reshape(-1, 4, 4))
    rows = len(goals), 8 if len(arm.columns) == 6 else 4
    shape = *pose.shape[:-2], rows[1]
    q = np.empty((*shape, len(arm.home)))
    valid, within = np.empty(shape, dtype=np.bool_), np.empty(shape, dtype=np.bool_)
    results = q.reshape(*rows, len(arm.home)), valid.reshape(rows), within.reshape(rows)
    kernels.solve_closed_form(*arm.cache["closed form"], deviation, goals, *results)
    return ClosedFormIK(make_read_only(q), make_read_only(valid), make_read_only(within))


def _derive_closed_form(arm: IKArm) -> tuple[Any, ...]:
    """Return the arguments of the kernel for an arm; raise InputError without a closed form."""
    h, p, T, rows = _find_joint_axes(arm)
    centre, rotation = _find_wrist_centre(h, p, arm.link), T[:3, :3].T
    base = np.stack([np.cross(h[1], h[0]), h[1], h[0]])  # rows: x, y, z that joint 1 carries
    tool = np.stack([rotation @ (centre - T[:3, 3]), rotation @ h[-1], rotation @ h[-2]])
    corners = np.stack([p[0], p[1], p[2], *p[3:][: len(h) == 5], centre]) - p[0]
    z, x = base[2] @ corners.T, base[0] @ corners.T
    axes = np.zeros(41)
    axes[: kernels.WRIST] = np.concatenate([base.ravel(), p[0], tool.ravel()])
    axes[kernels.WRIST :][: h[3:].size] = (h[3:] @ base.T).ravel()
    axes[kernels.BARS :][: 2 * len(corners) - 2] = np.column_stack([np.diff(z), np.diff(x)]).ravel()
    axes[kernels.SIGNS :] = *(h[2:4] @ h[1]), base[1] @ corners[-1]
    return _prepare_closed_form(arm, axes, rows)


def _prepare_closed_form(arm: IKArm, axes: Array, rows: NDArray[np.int64]) -> tuple[Any, ...]:
    """Return the arguments of the kernel: the stages that compute solutions and check them."""
    program = Program()
    tolerance, valid, within = program.rows(), program.rows(), program.rows()
    goal, q = program.rows(3, 4), program.constant(arm.home)
    limits = program.constant(arm.limits + LIMIT_SLACK * np.array([-1.0, 1.0]))
    form = kernels.solve_six_joints if len(rows) == 6 else kernels.solve_five_joints
    program.add(form, axes=program.constant(axes), goal=goal, angles=[q[i] for i in rows])
    program.add(kernels.fold_angles, joints=[(q[i], limits[i]) for i in rows])
    stages = FKStages(program, arm.tree.joints, q)
    stages.add()
    (T,) = stages.frames([arm.tree.find(arm.link)])
    program.add(
        kernels.check_solution,
        T=T,
        goal=goal,
        tolerance=tolerance,
        q=q,
        bounds=limits,
        valid_out=valid,
        within_out=within,
    )
    return program.prepared()


def _find_joint_axes(arm: IKArm) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Return the axes of the joints that carry the link, from the base on, at q = 0.

    The values are the directions h (n, 3), points p (n, 3) on the axes, the pose T of the link, and
    the rows of the coordinates. Raise InputError if one of the joints is not revolute.
    """
    tree = arm.tree
    columns = arm.columns[np.argsort(tree.owners[arm.columns])]
    if len(columns) not in (5, 6) or not all(kind.turns for kind in tree.kinds(columns)):
        raise _make_no_form_error(
            arm.link, f"five or six revolute joints carry it, not {len(columns)} velocities"
        )
    if np.isin(tree.velocity, columns).sum() != len(columns):
        raise _make_no_form_error(arm.link, "no joint follows another")
    rows, q = tree.alone(columns), arm.home.copy()
    q[rows] = 0.0
    bodies = tree.bodies(q[:, None])
    poses = bodies.poses[tree.owners[columns], :, :, 0]
    T = homogeneous_matrix(tree.frame(bodies, arm.link))[0]
    return poses[:, :, 2], poses[:, :, 3], T, rows


def _find_wrist_centre(h: Array, p: Array, link: str) -> Array:
    """Return the point that joints 4 and up leave fixed; raise InputError for other arms."""
    needs = [
        (_is_perpendicular(h[0], h[1]), "axis 2 is square to axis 1"),
        (_is_parallel(h[1], h[2]), "axis 3 is parallel to axis 2"),
    ]
    if len(h) == 5:
        parallel = "axis 4 of an arm of five joints is parallel to axes 2 and 3"
        needs.append((_is_parallel(h[1], h[3]), parallel))
        needs.append((_is_perpendicular(h[3], h[4]), "axis 5 is square to axis 4"))
    else:
        square = _is_perpendicular(h[3], h[4]) and _is_perpendicular(h[4], h[5])
        needs.append((square, "axes 4 and 6 are square to axis 5"))
    for holds, need in needs:
        if not holds:
            raise _make_no_form_error(link, need)
    if len(h) == 5:
        return np.asarray(p[4])
    centre = np.asarray(p[3] + h[3] * (h[3] @ (p[4] - p[3])))  # point of axis 4 nearest to p[4]
    apart = max(float(np.linalg.norm(np.cross(centre - p[i], h[i]))) for i in (4, 5))
    if apart > GEOMETRY_TOLERANCE:
        raise _make_no_form_error(
            link, f"axes 4, 5 and 6 meet in one point: they miss it by {apart:.3g} m"
        )
    return centre


def _make_no_form_error(link: str, needs: str) -> InputError:
    """Return the error for an arm that lacks a property that the closed form needs."""
    return InputError(
        f"no closed form is known for link '{link}': it requires that {needs}; robot.ik "
        "searches for coordinates of any arm"
    )


def _is_perpendicular(a: Array, b: Array) -> bool:
    """Return whether two unit vectors are perpendicular."""
    return bool(abs(a @ b) < GEOMETRY_TOLERANCE)


def _is_parallel(a: Array, b: Array) -> bool:
    """Return whether two unit vectors are parallel."""
    return bool(np.linalg.norm(np.cross(a, b)) < GEOMETRY_TOLERANCE)
