"""The ends of runs: why, when and where, in the image and in space."""

from __future__ import annotations

import math
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, euclidean_length, move_runs_last
from robsim.engine.outcome import Outcome
from robsim.geometry.pose import homogeneous_matrix
from robsim.servo.camera_target import compute_relative_pose
from robsim.servo.servo_controller import ServoController
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.composite import SeparateJointsController
from robsim.servo.tasks.joint_follower import JointFollower
from robsim.servo.tasks.path_follower import PathFollower
from robsim.servo.tasks.priorities import PriorityController
from robsim.servo.tasks.task_checks import count_fixed_motions

if TYPE_CHECKING:
    import xarray as xr

    from robsim.engine.loop import Loop

FAR, TURNED = 0.01, math.radians(1.0)  # metres and radians: beyond, it is another pose
NO_START = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA, Outcome.JOINT_LIMIT)  # if at time 0
UNITS = {"goal_pose": "m", "distance_to_goal": "m", "angle_to_goal": "rad"}
DESCRIPTIONS = {
    "goal_pose": "pose in the world of the frame that moves, had it ended at its goal",
    "distance_to_goal": "metres from there to where it ended",
    "angle_to_goal": "angle from that pose to the one in which it ended",
}


def is_valid_start(outcome: NDArray[Any], end_time: Array) -> NDArray[np.bool_]:
    """Return whether each start was in sight and within the limits of the joints."""
    return np.asarray(~((end_time == 0.0) & np.isin(outcome, NO_START)))


def make_end_variables(loop: Loop) -> dict[str, NDArray[Any]]:
    """Return the variables of a run that have one value for each run, which come first."""
    recorder, goal_pixels = loop.recorder, loop.controller.goal_pixels
    pixels_end = recorder.last.pixels.reshape(len(loop.q0), *goal_pixels.shape[-2:])
    return {
        "outcome": recorder.outcome,
        "end_time": recorder.end_step * loop.dt,
        "path_length": recorder.path_length,
        "pixel_error": _compute_largest_length(pixels_end - goal_pixels),
        "q0": loop.q0,
        "q_end": recorder.last.q[:, 0],
        "pixels_end": pixels_end,
        **make_goal_variables(loop.controller, recorder.last.q[:, 0], loop.q0),
        **({"ending": recorder.ending} if loop.endings else {}),
    }


def _compute_largest_length(away: Array) -> Array:
    """Return the largest length (runs,) of `away` (runs, marks, 2); NaN without marks."""
    if not away.shape[1]:
        return np.full(len(away), np.nan)
    return np.asarray(np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2).max(axis=1))


def make_goal_variables(controller: TaskController, q_end: Array, q0: Array) -> dict[str, Array]:
    """Return the variables of a run that say how far from its goal it ended.

    The frame is the camera; where the camera stands still, the target; without a camera, what is
    moved. Its goal is where it would be, the other of camera and target being where they ended.
    NaN where no pose is known (`GoalFeatures`, a user's controller), and of the angle where only a
    position is wanted.

    q_end, q0   (B, nq) where the runs ended and started
    """
    goal, away, turn = measure_goal_offset(controller, move_runs_last(q_end, 1), q0)
    poses = homogeneous_matrix(goal)
    poses[np.isnan(away)] = np.nan
    return {"goal_pose": poses, "distance_to_goal": away, "angle_to_goal": turn}


def measure_goal_offset(
    controller: TaskController, q: Array, q0: Array
) -> tuple[Array, Array, Array]:
    """Return the goal pose (3, 4, B) of the frame that moves, and metres and radians to it (B,).

    q (nq, B) says where the runs are, q0 (B, nq) where they started.
    """
    part = select_goal_controller(controller)
    with np.errstate(invalid="ignore", over="ignore"):  # a run that went wrong is data
        T = compute_moving_pose(part, q)
        goal = compute_goal_pose(part, q, q0)
        goal = np.full(T.shape, np.nan) if goal is None else goal
        away, turn = measure_pose_difference(goal, T)
    if isinstance(part, PathFollower) and part.k == 3:  # the orientation is free
        goal[:, :3], turn = T[:, :3], np.full(turn.shape, np.nan)
    lost = np.isnan(q).any(axis=0) | ~np.isfinite(away)
    return goal, np.where(lost, np.nan, away), np.where(lost, np.nan, turn)


def find_converged_elsewhere(run: xr.Dataset) -> NDArray[np.bool_]:
    """Return which runs, () or (B,), converged at another pose than that of their goal.

    That is more than 1 cm or 1 degree away, whatever the features say: they may have the same
    values at several poses, or leave motions free.
    """
    far = (run["distance_to_goal"].values > FAR) | (run["angle_to_goal"].values > TURNED)
    return np.asarray(far & (run["outcome"].values == Outcome.CONVERGED))


def make_goal_attributes(controller: TaskController) -> dict[str, Any]:
    """Return whose goal it is, and how many motions of that frame the task leaves free there."""
    return {
        "frame": select_goal_controller(controller).moving,
        "free_motions": count_free_motions(controller),
    }


def count_free_motions(controller: TaskController) -> int:
    """Return how many of the motions that the joints can make the features leave free.

    Of tasks beside each other, the least.
    """
    if isinstance(controller, SeparateJointsController):
        return min(map(count_free_motions, controller.parts))
    servos = _list_part_controllers(controller)
    counts = [count_fixed_motions(each) for each in servos if isinstance(each, ServoController)]
    full = max((full for _, full in counts), default=0)
    return max(full - sum(fixed for fixed, _ in counts), 0)


def select_goal_controller(controller: TaskController) -> TaskController:
    """Return the controller whose goal is that of the run.

    Of several, the first with a camera and a goal whose pose is known; else the first of those
    with a camera, else the first.
    """
    leaves = sorted(_list_part_controllers(controller), key=lambda each: not each.sights)
    known = (
        each
        for each in leaves
        if not isinstance(each, ServoController) or each.regulated.given is None
    )
    return next(known, leaves[0])


def _list_part_controllers(controller: TaskController) -> list[TaskController]:
    """Return the controllers of which one is made, or itself."""
    if not isinstance(controller, SeparateJointsController | PriorityController):
        return [controller]
    return [leaf for part in controller.parts for leaf in _list_part_controllers(part)]


def compute_moving_pose(controller: TaskController, q: Array) -> Array:
    """Return the pose T_w_f (3, 4, B) of the frame that moves, at coordinates q (nq, B)."""
    tree = controller.scene.tree
    return tree.frame(tree.bodies(q), controller.moving)


@singledispatch
def compute_goal_pose(controller: TaskController, q: Array, q0: Array) -> Array | None:
    """Return the pose T_w_f (3, 4, B) that this frame has at the goal; None where it is unknown.

    q (nq, B) says where everything else is, q0 (B, nq) where the runs started.
    """
    return None


@compute_goal_pose.register
def _compute_servo_goal(controller: ServoController, q: Array, q0: Array) -> Array | None:
    """Return the goal pose from T_c_o at the goal and from where target or camera are."""
    T_c_o = get_camera_goal(controller)
    if T_c_o is None:
        return None
    seen = controller.sights[0].project(q)
    T_c_o = np.broadcast_to(T_c_o, seen.T_w_c.shape)
    if controller.moving != controller.frame:
        return _compose_poses(seen.T_w_c, T_c_o)
    here = np.repeat(np.eye(3, 4)[..., None], T_c_o.shape[2], axis=2)
    return _compose_poses(seen.T_w_o, compute_relative_pose(T_c_o, here))


def _compose_poses(A: Array, B: Array) -> Array:
    """Return A B of poses (3, 4, runs), in plain NumPy without compiling."""
    out: Array = A[:, :1] * B[0] + A[:, 1:2] * B[1] + A[:, 2:3] * B[2]
    out[:, 3] += A[:, 3]
    return out


@compute_goal_pose.register
def _compute_path_end(controller: PathFollower, q: Array, q0: Array) -> Array | None:
    """Return the end of the path for each run."""
    return np.repeat(controller.end[..., None], q.shape[1], axis=-1)


@compute_goal_pose.register
def _compute_joint_goal(controller: JointFollower, q: Array, q0: Array) -> Array | None:
    """Return the pose with the joints at their goal, and the others where they are."""
    there = q.copy()
    there[controller.coordinates] = np.atleast_2d(
        controller.goal_from(q0[:, controller.coordinates])
    ).T
    return compute_moving_pose(controller, there)


def get_camera_goal(controller: TaskController) -> Array | None:
    """Return T_c_o (3, 4, B) of the first camera and its target at the goal, as it was meant.

    A goal that is shown is where the true camera stood, a pose is as it was given; None of
    features that are given as numbers.
    """
    part = select_goal_controller(controller)
    if not isinstance(part, ServoController) or part.regulated.given is not None:
        return None
    sight, q = part.sights[0], part.regulated.q_goal
    if q is None:
        return part.regulated.goals[sight.key].guess_last
    seen = sight.project(q)
    return compute_relative_pose(seen.T_w_c, seen.T_w_o)


def measure_pose_difference(A: Array, B: Array) -> tuple[Array, Array]:
    """Return metres and radians (B,) between poses (3, 4, B) in the same axes."""
    away = np.ascontiguousarray(B[:, 3] - A[:, 3])
    return euclidean_length(away), compute_rotation_angle((B[:, :3] - A[:, :3]).reshape(9, -1))


def compute_rotation_angle(change: Array) -> Array:
    """Return the angle (...) between rotations from the 9 differences (9, ...) of their numbers.

    |R1 - R2| = sqrt(8) sin(angle / 2), which keeps its digits where the angle is small.
    """
    return np.asarray(2.0 * np.arcsin(np.minimum(euclidean_length(change) / np.sqrt(8.0), 1.0)))
