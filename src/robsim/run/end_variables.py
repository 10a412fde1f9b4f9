"""Variables of a run that describe its end, in the image and in space."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, singledispatch
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

FAR, TURNED = 0.01, math.radians(1.0)  # metres and radians; poses farther apart are different
UPSIDE_DOWN = math.radians(170.0)  # larger angles are half a turn
NO_START = (  # at time 0
    *(Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA, Outcome.JOINT_LIMIT),
    *(Outcome.UNDETECTED, Outcome.NO_GRADIENT, Outcome.NOTHING_IN_VIEW),
)
UNITS = {"goal_pose": "m", "distance_to_goal": "m", "angle_to_goal": "rad"}
DESCRIPTIONS = {
    "goal_pose": "goal pose of the moving frame in the world",
    "distance_to_goal": "distance from the goal pose to the final pose",
    "angle_to_goal": "angle from the goal pose to the final pose",
}


def is_valid_start(outcome: NDArray[Any], end_time: Array) -> NDArray[np.bool_]:
    """Return whether each start was seen by the cameras and within the joint limits."""
    return np.asarray(~((end_time == 0.0) & np.isin(outcome, NO_START)))


def list_end_variables(loop: Loop) -> dict[str, Callable[[], NDArray[Any]]]:
    """Return functions that compute the variables of a run with one value per run."""
    recorder, controller = loop.recorder, loop.controller
    goal_pixels = controller.goal_pixels
    goal = cache(lambda: make_goal_variables(controller, get_q_end(), loop.q0))

    def get_q_end() -> Array:
        return recorder.last.q[:, 0]

    def get_pixels_end() -> Array:
        return recorder.last.pixels.reshape(len(loop.q0), *goal_pixels.shape[-2:])

    return {
        "outcome": lambda: recorder.outcome,
        "end_time": lambda: recorder.end_step * loop.dt,
        "path_length": lambda: recorder.path_length,
        "pixel_error": lambda: _compute_largest_length(get_pixels_end() - goal_pixels),
        "q0": lambda: loop.q0,
        "q_end": get_q_end,
        "pixels_end": get_pixels_end,
        "goal_pose": lambda: goal()["goal_pose"],
        "distance_to_goal": lambda: goal()["distance_to_goal"],
        "angle_to_goal": lambda: goal()["angle_to_goal"],
        **({"ending": lambda: recorder.ending} if loop.endings else {}),
    }


def _compute_largest_length(away: Array) -> Array:
    """Return the largest length (runs,) of vectors (runs, marks, 2); NaN without marks."""
    if not away.shape[1]:
        return np.full(len(away), np.nan)
    return np.asarray(np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2).max(axis=1))


def make_goal_variables(controller: TaskController, q_end: Array, q0: Array) -> dict[str, Array]:
    """Return the goal pose of each run, and the distance and angle to it at the end.

    The moving frame is the camera, or the target if the camera does not move, or the controlled
    frame if there is no camera. The goal pose of a camera is relative to the final pose of its
    target, and the goal pose of a target is relative to the final pose of its camera. Values are
    NaN if no goal pose is known (`GoalFeatures`, a user's controller). The angle is NaN if the task
    controls the position only.

    Parameters
    ----------
    controller : Controller
        Task bound to a scene.
    q_end, q0 : ndarray of shape (B, nq)
        Coordinates at the end and at the start of the runs.
    """
    goal, away, turn = measure_goal_offset(controller, move_runs_last(q_end, 1), q0)
    poses = homogeneous_matrix(goal)
    poses[np.isnan(away)] = np.nan
    return {"goal_pose": poses, "distance_to_goal": away, "angle_to_goal": turn}


def measure_goal_offset(
    controller: TaskController, q: Array, q0: Array
) -> tuple[Array, Array, Array]:
    """Return the goal pose (3, 4, B) of the moving frame, and the distance and angle to it (B,).

    q (nq, B) are the present coordinates, q0 (B, nq) the coordinates at the start.
    """
    part = select_goal_controller(controller)
    with np.errstate(invalid="ignore", over="ignore"):  # runs may end with NaN
        T = compute_moving_pose(part, q)
        goal = compute_goal_pose(part, q, q0)
        goal = np.full(T.shape, np.nan) if goal is None else goal
        away, turn = measure_pose_difference(goal, T)
    if isinstance(part, PathFollower) and part.k == 3:  # the orientation is free
        goal[:, :3], turn = T[:, :3], np.full(turn.shape, np.nan)
    lost = np.isnan(q).any(axis=0) | ~np.isfinite(away)
    return goal, np.where(lost, np.nan, away), np.where(lost, np.nan, turn)


def find_converged_elsewhere(run: xr.Dataset) -> NDArray[np.bool_]:
    """Return a mask, () or (B,), of the runs that converged at another pose than their goal.

    These runs ended more than 1 cm or 1 degree from the goal pose. The features may have equal
    values at several poses, or leave motions free.
    """
    far = (run["distance_to_goal"].values > FAR) | (run["angle_to_goal"].values > TURNED)
    return np.asarray(far & (run["outcome"].values == Outcome.CONVERGED))


def make_goal_attributes(controller: TaskController) -> dict[str, Any]:
    """Return the moving frame, and the number of motions that the task leaves free at the goal."""
    return {
        "frame": select_goal_controller(controller).moving,
        "free_motions": count_free_motions(controller),
    }


def count_free_motions(controller: TaskController) -> int:
    """Return the number of possible motions that the features leave free.

    For parallel tasks, return the smallest number.
    """
    if isinstance(controller, SeparateJointsController):
        return min(map(count_free_motions, controller.parts))
    servos = _list_part_controllers(controller)
    counts = [count_fixed_motions(each) for each in servos if isinstance(each, ServoController)]
    full = max((full for _, full in counts), default=0)
    return max(full - sum(fixed for fixed, _ in counts), 0)


def select_goal_controller(controller: TaskController) -> TaskController:
    """Return the controller that defines the goal of the run.

    If there are several controllers, return the first with a camera and a known goal pose, else the
    first with a camera, else the first.
    """
    leaves = sorted(_list_part_controllers(controller), key=lambda each: not each.sights)
    known = (
        each
        for each in leaves
        if not isinstance(each, ServoController) or each.bound_features.goal_values is None
    )
    return next(known, leaves[0])


def _list_part_controllers(controller: TaskController) -> list[TaskController]:
    """Return the controllers that form a composite one, or the controller itself."""
    if not isinstance(controller, SeparateJointsController | PriorityController):
        return [controller]
    return [leaf for part in controller.parts for leaf in _list_part_controllers(part)]


def compute_moving_pose(controller: TaskController, q: Array) -> Array:
    """Return the pose T_w_f (3, 4, B) of the moving frame at coordinates q (nq, B)."""
    tree = controller.scene.tree
    return tree.frame(tree.bodies(q), controller.moving)


@singledispatch
def compute_goal_pose(controller: TaskController, q: Array, q0: Array) -> Array | None:
    """Return the goal pose T_w_f (3, 4, B) of the moving frame; None if it is unknown.

    q (nq, B) are the present coordinates of all other joints, q0 (B, nq) the start.
    """
    return None


@compute_goal_pose.register
def _compute_servo_goal(controller: ServoController, q: Array, q0: Array) -> Array | None:
    """Return the goal pose from T_c_o at the goal and the present pose of target or camera."""
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
    """Return the products A B of poses (3, 4, runs), in NumPy without compilation."""
    out: Array = A[:, :1] * B[0] + A[:, 1:2] * B[1] + A[:, 2:3] * B[2]
    out[:, 3] += A[:, 3]
    return out


@compute_goal_pose.register
def _compute_path_end(controller: PathFollower, q: Array, q0: Array) -> Array | None:
    """Return the end of the path for each run."""
    return np.repeat(controller.end[..., None], q.shape[1], axis=-1)


@compute_goal_pose.register
def _compute_joint_goal(controller: JointFollower, q: Array, q0: Array) -> Array | None:
    """Return the pose with the followed joints at their goal, and the others as they are."""
    goal = q.copy()
    goal[controller.coordinates] = np.atleast_2d(
        controller.goal_from(q0[:, controller.coordinates])
    ).T
    return compute_moving_pose(controller, goal)


def get_camera_goal(controller: TaskController) -> Array | None:
    """Return the intended T_c_o (3, 4, B) of the first camera and its target at the goal.

    A goal configuration defines it by the true pose of the camera there, a goal pose directly.
    Return None if the goal features are given as numbers.
    """
    part = select_goal_controller(controller)
    if not isinstance(part, ServoController) or part.bound_features.goal_values is not None:
        return None
    regulated = part.bound_features
    shown = regulated.goal_views.compute_target_pose()
    return regulated.goals[part.sights[0].key].guess_last if shown is None else shown


def measure_pose_difference(A: Array, B: Array) -> tuple[Array, Array]:
    """Return the distances and angles (B,) between poses (3, 4, B) in the same axes."""
    away = np.ascontiguousarray(B[:, 3] - A[:, 3])
    return euclidean_length(away), compute_rotation_angle((B[:, :3] - A[:, :3]).reshape(9, -1))


def compute_rotation_angle(change: Array) -> Array:
    """Return the angle (...) between rotations from the differences (9, ...) of their entries.

    |R1 - R2| = sqrt(8) sin(angle / 2). The formula keeps its precision for small angles.
    """
    return np.asarray(2.0 * np.arcsin(np.minimum(euclidean_length(change) / np.sqrt(8.0), 1.0)))
