"""Handles: poses that a user can drag in the scene, and the resulting changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare.controls import Control
from robsim.geometry.pose import Pose
from robsim.page.recording_frames import convert_poses_to_numbers
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.servo.goals.goal import GoalPose
from robsim.studio.control_values import is_json_number
from robsim.studio.frame_placement import find_carrier, solve_frame_placement
from robsim.studio.rounded_values import round_dragged_value
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

FAR = 1e3  # largest coordinate of a dragged pose, metres


@dataclass(frozen=True)
class Handle:
    """A pose that a user can drag, relative to the frame of the figures.

    The handle of a body that a robot carries moves with the body; dragging it moves the robot.

    Attributes
    ----------
    name : str
        "start", "goal", or the dotted name of a body, such as "objects.plate".
    frame : str
        Frame of the scene at this pose.
    pose : list of 7 float
        Position and quaternion (x, y, z, w); of a carried body, at the last change.
    carried : bool
        Whether a robot carries the body.
    """

    name: str
    frame: str
    pose: list[float]
    carried: bool = False


def list_handles(
    experiment: Experiment, controls: Mapping[str, Control], frame: str, goal: Pose | None
) -> list[Handle]:
    """Return the handles of the fixed bodies, and of the start and the goal of the moving frame.

    `goal` is the goal pose of the moving frame in the world; None if it is unknown.
    """
    scene, q = experiment.scene, _read_start_configuration(experiment)
    handles = [
        _build_handle(scene, name, body.name, scene.pose(body.name, q))
        for name, body in _list_fixed_bodies(scene)
    ]
    if _find_movable_robot(scene, frame) is None:
        return handles
    handles.append(_build_handle(scene, "start", frame, scene.pose(frame, q)))
    if goal is not None and any(name.startswith("task.goal.") for name in controls):
        handles.append(_build_handle(scene, "goal", frame, goal))
    return handles


def list_carried_handles(scene: Scene, q: Array) -> list[Handle]:
    """Return the handles of the bodies that commanded robots carry, at the coordinates q (nq,)."""
    return [
        replace(_build_handle(scene, name, body.name, scene.pose(body.name, q)), carried=True)
        for name, body in _list_bodies(scene)
        if scene.tree.flag_moves(body.name).any() and _find_movable_robot(scene, body.name)
    ]


def solve_drag(scene: Scene, handle: Handle, pose: Any, q: Array) -> Array:
    """Return coordinates (nq,) near q that place the carried body of a handle at a pose (7,).

    Raise InputError if the pose is invalid or cannot be reached.
    """
    T = scene.display.inv() @ _parse_dragged_pose(pose)
    return solve_frame_placement(scene, handle.frame, T, q)


def compute_drag_changes(
    experiment: Experiment, controls: Mapping[str, Control], handle: Handle, pose: Any
) -> dict[str, Any]:
    """Return the changes that move a handle to a pose (7,) relative to the frame of the figures.

    The body of the handle is fixed. Raise InputError if the pose is invalid or cannot be reached.
    """
    scene, q = experiment.scene, _read_start_configuration(experiment)
    T = scene.display.inv() @ _parse_dragged_pose(pose)
    if handle.name not in ("start", "goal"):
        body = dict(_list_fixed_bodies(scene))[handle.name]
        return _build_pose_changes(controls, handle.name, scene.pose(body.on, q).inv() @ T)
    goal = getattr(experiment.task, "goal", None)
    if handle.name == "goal" and isinstance(goal, GoalPose):
        return _build_pose_changes(
            controls,
            "task.goal.computed",
            _compute_target_in_camera(experiment, handle.frame, T, q),
        )
    root = "start" if handle.name == "start" else "task.goal"
    reached = solve_frame_placement(scene, handle.frame, T, q)
    if control := controls.get(f"{root}.q"):
        return control.changes(round_dragged_value(control, reached.tolist()))
    return _build_pose_changes(controls, root, Pose.from_quaternion(reached[:3], reached[3:]))


def _build_handle(scene: Scene, name: str, frame: str, T_w_f: Pose) -> Handle:
    """Return the handle of a frame at a pose in the world."""
    T = (scene.display @ T_w_f).matrix
    return Handle(name, frame, convert_poses_to_numbers(T[None])[0].tolist())


def _read_start_configuration(experiment: Experiment) -> Array:
    """Return the start configuration (nq,) of an experiment."""
    start = experiment.scene.home if experiment.start is None else experiment.start
    return np.asarray(np.atleast_2d(start)[0])


def _list_bodies(scene: Scene) -> Iterator[tuple[str, Object | MountedCamera]]:
    """Yield the dotted name and the body of each object and camera."""
    for kind in ("objects", "cameras"):
        for body in getattr(scene, kind):
            yield f"{kind}.{body.name}", body


def _list_fixed_bodies(scene: Scene) -> Iterator[tuple[str, Object | MountedCamera]]:
    """Yield the dotted name and the body of each object and camera that no robot moves."""
    for name, body in _list_bodies(scene):
        if not scene.tree.flag_moves(body.name).any():
            yield name, body


def _parse_dragged_pose(value: Any) -> Pose:
    """Return the pose of a list of 7 numbers; raise InputError unless it is valid."""
    is_list = isinstance(value, list) and len(value) == 7 and all(map(is_json_number, value))
    if not is_list or max(map(abs, value)) > FAR:
        raise InputError(
            f"drag: expected 7 numbers, a pose within {FAR:g} m, got {format_value(value)}"
        )
    numbers = np.array(value, dtype=float)
    size = np.linalg.norm(numbers[3:])
    if not 0.5 < size < 2.0:
        raise InputError("drag: the quaternion (x, y, z, w) must have length 1")
    return Pose.from_quaternion(numbers[:3], numbers[3:] / size)


def _build_pose_changes(controls: Mapping[str, Control], root: str, T: Pose) -> dict[str, Any]:
    """Return the changes that set the controls of a pose."""
    position, rotvec = controls[f"{root}.position"], controls[f"{root}.rotvec"]
    return {
        **position.changes(round_dragged_value(position, T.position.tolist())),
        **rotvec.changes(round_dragged_value(rotvec, T.rotvec.tolist())),
    }


def _compute_target_in_camera(experiment: Experiment, frame: str, T: Pose, q: Array) -> Pose:
    """Return the pose T_c_o of the target in the camera when the moving frame is at T."""
    scene, task = experiment.scene, experiment.task
    eye, target = scene.camera(task.camera).name, scene.object(task.target).name
    T_w_c = T if frame == eye else scene.pose(eye, q)
    T_w_o = T if frame == target else scene.pose(target, q)
    return T_w_c.inv() @ T_w_o


def _find_movable_robot(scene: Scene, frame: str) -> Robot | None:
    """Return the robot that carries a frame; None without one, or if its motion is prescribed."""
    try:
        robot, _ = find_carrier(scene, frame)
    except InputError:
        return None
    return None if any(each.robot == robot.name for each in scene.motions) else robot
