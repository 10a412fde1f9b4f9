"""The motion that remains to the goal, and its parts that a task cannot or does not make."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_list, format_offset
from robsim.analysis.vector_fields import STEP, VectorField, compute_target_pose
from robsim.base.arrays import Array
from robsim.features.motion_words import describe_twist, reduce_motions
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.run import end_variables
from robsim.servo.controller_matrices import compute_controller_matrices, list_servo_controllers
from robsim.servo.task_controller import TaskController

NEAR, ALIGNED = 1e-3, math.radians(0.1)  # metres and radians from the goal that are negligible
RANK = 1e-6  # relative size below which a singular value counts as zero
SHARE = 0.1  # parts below this share of the whole motion follow from its curvature


@dataclass(frozen=True, eq=False)
class GoalMotion:
    """The motion (6,) of the camera relative to its target to the goal pose, and three parts of it.

    Motions are twists (v, omega) over one second, in axes of the camera, in m and rad.

    Attributes
    ----------
    whole : array of shape (6,)
        Motion from the present pose to the goal pose.
    outside : array of shape (6,)
        Part that no commanded velocity produces, at any heading of a vehicle.
    sideways : array of shape (6,)
        Part along directions in which the wheels of a vehicle do not roll, as far as the features
        demand it.
    unseen : array of shape (6,)
        Part along motions that change no feature.
    free : tuple of str
        The motions that change no feature, in words.
    """

    whole: Array
    outside: Array
    sideways: Array
    unseen: Array
    free: tuple[str, ...] = ()

    def clauses(self) -> Iterator[str]:
        """Yield a clause for each part that is not negligible."""
        if self.is_part(self.unseen):
            yield (
                f"the features do not change along {_format_part(self.unseen)} of the way to the "
                f"goal pose ({format_list(self.free)}), so they hold the camera at no single pose"
            )
        if self.is_part(self.sideways):
            yield (
                f"the wheels do not roll along {_format_part(self.sideways)} of the way to the "
                "goal pose, which lie sideways: the vehicle must turn away and manoeuvre"
            )
        if self.is_part(self.outside):
            yield (
                f"the commanded velocities do not produce {_format_part(self.outside)} of the way "
                "to the goal pose"
            )

    def is_part(self, part: Array) -> bool:
        """Return whether a part is neither negligible nor due to the curvature of the motion."""
        length, angle = _measure(part)
        least_length, least_angle = SHARE * _measure(self.whole)
        return bool(length > max(NEAR, least_length) or angle > max(ALIGNED, least_angle))


def report_goal_motion(analysis: RunAnalysis, instant: int) -> list[Finding]:
    """Report the parts of the way to the goal that the task does not make from an instant on."""
    motion = split_goal_motion(analysis.controller, analysis.state(instant).q)
    if motion is None:
        return []
    evidence = dict(zip(("off_m", "off_rad"), _measure(motion.whole).tolist(), strict=True))
    sentences = (f"{each[0].upper()}{each[1:]}." for each in motion.clauses())
    return [Finding("way to the goal", each, evidence) for each in sentences]


def report_sideways_goal(analysis: RunAnalysis) -> Finding | None:
    """Report a goal to the side of a vehicle at its start, where its wheels do not roll."""
    motion = split_goal_motion(analysis.controller, analysis.first_state.q)
    if motion is None or not motion.is_part(motion.sideways):
        return None
    *_, clause = replace(motion, outside=0.0 * motion.outside).clauses()
    length, angle = _measure(motion.sideways).tolist()
    evidence = {"sideways_m": length, "sideways_rad": angle}
    return Finding("sideways goal", f"At the start {clause}.", evidence)


def report_missing_motion(analysis: RunAnalysis) -> Finding | None:
    """Report the first part of the way to the goal that the task does not make at the end."""
    return next(iter(report_goal_motion(analysis, -1)), None)


def split_goal_motion(controller: TaskController, q: Array) -> GoalMotion | None:
    """Return the motion to the goal at q (nq, 1); None if no goal pose of a camera is known."""
    goal = end_variables.get_camera_goal(controller)
    if goal is None:
        return None
    part = end_variables.select_goal_controller(controller)
    present = compute_target_pose(part.sights[0], q)[0]
    whole = _compute_twist(present, Pose(homogeneous_matrix(goal)[0]))
    if not np.isfinite(whole).all():
        return None
    scale = np.repeat([1.0, max(float(np.linalg.norm(present.position)), NEAR)], 3)
    producible = _span(scale[:, None] * _compute_camera_motions(controller, part, q))
    rolling = _span(scale[:, None] * _compute_camera_motions(controller, part, q, rolls=True))
    x = scale * whole
    inside = producible @ (producible.T @ x)
    unseen = producible @ _list_unseen_motions(controller, part, q, producible / scale[:, None])
    easy = _span(np.concatenate([rolling, unseen], axis=1))
    words = reduce_motions(unseen / scale[:, None], True).T
    return GoalMotion(
        whole,
        (x - inside) / scale,
        (inside - easy @ (easy.T @ inside)) / scale,
        unseen @ (unseen.T @ x) / scale,
        tuple(map(describe_twist, words)),
    )


def _compute_camera_motions(
    controller: TaskController, part: TaskController, q: Array, rolls: bool = False
) -> Array:
    """Return the twists (6, m) of the camera relative to its target by the commanded velocities.

    Unless the wheels of vehicles must roll (`rolls`), their sideways motions are included.
    """
    n = controller.columns.size
    states = VectorField(controller).displace(np.repeat(q, n, axis=1), STEP * np.eye(n))
    if not rolls:
        states = np.concatenate([states, _displace_sideways(controller, q)], axis=1)
    poses = compute_target_pose(part.sights[0], np.concatenate([q, states], axis=1))
    twists = [_compute_twist(poses[0], poses[i + 1]) / STEP for i in range(states.shape[1])]
    return np.array(twists).reshape(-1, 6).T


def _displace_sideways(controller: TaskController, q: Array) -> Array:
    """Return the states (nq, m) with each commanded vehicle displaced along x, and along y."""
    tree = controller.scene.tree
    driven = {int(body) for body in tree.owners[controller.columns] if tree.models[body].wheeled}
    places = [
        int(row)
        for body, kind, rows, *_ in tree.members
        if kind.wheeled and body in driven
        for row in np.arange(len(q))[rows][:2]
    ]
    states = np.repeat(q, len(places), axis=1)
    states[places, range(len(places))] += STEP
    return states


def _compute_twist(present: Pose, other: Pose) -> Array:
    """Return the motion (6,) of a camera between two poses T_c_o of its target."""
    moved = present @ other.inv()
    return np.concatenate([moved.position, moved.rotvec])


def _list_unseen_motions(
    controller: TaskController, part: TaskController, q: Array, motions: Array
) -> Array:
    """Return combinations (m, j) of camera motions (6, m) that change no feature of this camera."""
    matrices = [
        compute_controller_matrices(each, q).interaction
        for each in list_servo_controllers(controller)
        if each.sights[0].key == part.sights[0].key
    ]
    rates = [np.asarray(each.matrix[0]) @ motions for each in matrices if each is not None]
    if not rates or len(rates) < len(matrices) or not np.isfinite(np.concatenate(rates)).all():
        return np.zeros((motions.shape[1], 0))
    _, sigma, Vt = np.linalg.svd(np.concatenate(rates), full_matrices=True)
    rank = int((sigma > controller.rcond * sigma[:1]).sum())
    return np.asarray(Vt[rank:].T)


def _span(motions: Array) -> Array:
    """Return an orthonormal basis (6, r) of the motions (6, m)."""
    U, sigma, _ = np.linalg.svd(motions, full_matrices=False)
    return np.asarray(U[:, sigma > RANK * sigma[:1]])


def _measure(motion: Array) -> Array:
    """Return the length and the angle of a motion (6,)."""
    return np.array([np.linalg.norm(motion[:3]), np.linalg.norm(motion[3:])])


def _format_part(motion: Array) -> str:
    length, angle = _measure(motion)
    return format_offset(length if length > NEAR else 0.0, angle if angle > ALIGNED else 0.0)
