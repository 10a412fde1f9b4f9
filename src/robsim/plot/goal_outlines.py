"""Outlines of the camera, target or tool at the goal of a motion, in 3-D."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose, PoseLike, check_single_pose, is_pose_like
from robsim.plot import wireframe
from robsim.plot.scene_motion import list_cameras_and_objects
from robsim.plot.wireframe import (
    CameraSolidBuilder,
    DrawableShapes,
    ScenePart,
    SolidBuilder,
    WireSolid,
    build_shape_solid,
)
from robsim.servo.goals.body_place import Places, place_bodies
from robsim.servo.goals.goal import Goal, GoalFeatures, GoalPose, TaughtGoal
from robsim.servo.tasks.task import Task
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from robsim.plot.run_data import RunVariables

AXES = 0.6  # length of the axes of a frame, as a share of the depth of a frustum
DrawableGoal = PoseLike | Goal | Task  # a configuration or pose, the goal of a task, or a task


def build_goal_outlines(
    scene: Scene, goal: DrawableGoal | None, run: xr.Dataset | None, q: Array, depth: float
) -> list[WireSolid]:
    """Return the outlines of a goal, in the frame of the figures; none if the goal has no pose.

    `goal` is a configuration (nq,), a pose in the world, a task or the goal of a task; None selects
    the goal of the run. A pose is the goal of the first camera or object that a robot moves, or of
    the tip of the first robot if the robots move neither. `q` (nq,) is the configuration of all
    other bodies. `depth` is the depth in metres of the frustum of a camera without a body.

    Raise InputError if `goal` has another type.
    """
    poses = read_goal_pose(run) if goal is None else _find_goal_poses(scene, goal, q)
    return [
        wireframe.place_part(
            ScenePart(name, wire), lambda frame: scene.display.matrix @ poses[frame].matrix
        )
        for name in poses
        for wire in build_frame_outline(scene, name, depth)
    ]


def _find_goal_poses(scene: Scene, goal: DrawableGoal, q: Array) -> dict[str, Pose]:
    """Return the poses of frames in the world at a goal, by the name of the frame."""
    if isinstance(goal, Task):
        own = getattr(goal, "goal", None)
        return _find_goal_poses(scene, own, q) if isinstance(own, TaughtGoal | GoalPose) else {}
    if isinstance(goal, GoalFeatures):
        return {}
    if isinstance(goal, GoalPose):
        return _resolve_relative_goal(scene, lambda eye, target: goal.T_c_o, q)
    if isinstance(goal, TaughtGoal):
        return _find_shown_poses(scene, goal, q)
    values = cast("ArrayLike", goal)
    if is_pose_like(values) and np.shape(values) != (scene.nq,):
        return {_list_goal_frames(scene)[0]: check_single_pose(values, "goal")}
    return _compute_frame_poses(scene, values)


def _find_shown_poses(scene: Scene, goal: TaughtGoal, q: Array) -> dict[str, Pose]:
    """Return the poses of frames at a shown goal, relative to bodies that have moved since."""
    q_shown = scene.home if goal.q is None else cast("ArrayLike", goal.q)
    if not goal.places:
        return _compute_frame_poses(scene, q_shown)
    shown = place_bodies(scene, {each.name: each.pose for each in cast(Places, goal.places)})
    return _resolve_relative_goal(
        scene, lambda eye, target: _compute_target_pose(shown, eye, target, q_shown), q
    )


def read_goal_pose(run: RunVariables | None) -> dict[str, Pose]:
    """Return the goal pose stored in a run, by its frame; empty if there is none."""
    if run is None or "goal_pose" not in run:
        return {}
    T = run["goal_pose"].values
    return {str(run["goal_pose"].attrs["frame"]): Pose(T)} if np.isfinite(T).all() else {}


def _list_goal_frames(scene: Scene) -> list[str]:
    """Return the cameras and objects that robots move; without any, the tip of the first robot."""
    carried = [
        name for name in list_cameras_and_objects(scene) if scene.tree.flag_moves(name).any()
    ]
    tips = [f"{robot.name}.{robot.tip}" for robot in scene.robots[:1]]
    frames = carried or tips or list_cameras_and_objects(scene)[:1]
    if not frames:
        raise InputError("goal: the scene has no robot, camera or object")
    return frames


def _compute_frame_poses(scene: Scene, q: ArrayLike) -> dict[str, Pose]:
    """Return the poses of all moving frames at q (nq,)."""
    values = scene.coordinates(q, "goal q", limits=False)
    if values.ndim != 1:
        raise InputError(f"goal q: expected shape ({scene.nq},), got {values.shape}")
    return {name: scene.pose(name, values) for name in _list_goal_frames(scene)}


def _compute_target_pose(scene: Scene, eye: str, target: str, q: ArrayLike) -> Pose:
    """Return the pose T_c_o of a target in a camera at q (nq,)."""
    return Pose(scene.pose(eye, q).matrix).inv() @ Pose(scene.pose(target, q).matrix)


def _resolve_relative_goal(
    scene: Scene, find_goal: Callable[[str, str], Pose], q: Array
) -> dict[str, Pose]:
    """Return the goal pose of the camera if it moves, otherwise the goal pose of the target.

    `find_goal` returns T_c_o at the goal from the names of camera and target.
    """
    targets = [obj.name for obj in scene.objects if len(obj.marks)]
    if not scene.cameras or not targets:
        return {}
    eye, target = scene.cameras[0].name, targets[0]
    T_c_o = find_goal(eye, target)
    if scene.tree.flag_moves(eye).any():
        return {eye: Pose(scene.pose(target, q).matrix) @ T_c_o.inv()}
    return {target: Pose(scene.pose(eye, q).matrix) @ T_c_o}


def build_frame_outline(
    scene: Scene,
    name: str,
    depth: float,
    drawable: DrawableShapes | None = None,
    build: SolidBuilder | None = None,
    build_camera: CameraSolidBuilder | None = None,
) -> list[WireSolid]:
    """Return the outline of the body of a frame in its own axes, or the axes if it has no body.

    `drawable`, `build` and `build_camera` as in `list_scene_parts`.
    """
    drawable, build = drawable or wireframe.list_drawable_shapes, build or build_shape_solid
    for eye in scene.cameras:
        if eye.name == name:
            return [(build_camera or wireframe.build_camera_solid)(eye, depth)]
    shapes = drawable(wireframe.list_scene_shapes(scene)[name])
    if shapes:
        return [build(name, shape) for shape in shapes]
    return [
        WireSolid(name, "", np.stack([np.zeros(3), end])[None]) for end in AXES * depth * np.eye(3)
    ]
