"""Outlines of the goal, the start, the believed scene and the second scheme; trails of motion."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.page.recording_frames import (
    Entry,
    PosesOf,
    RecordingFrames,
    add_shape_arrays,
    build_solid_entries,
)
from robsim.plot import goal_outlines, palette
from robsim.plot.scene_motion import STILL, SceneMotion, list_cameras_and_objects
from robsim.plot.wireframe import compute_display_pose
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


def list_outline_entries(
    stage: RecordingFrames, belief: Scene | None, run: xr.Dataset, depth: float
) -> list[Entry]:
    """Return the outlines of the goal, the start, displaced believed bodies and second scheme."""
    starts = build_solid_entries(
        stage,
        stage.motion.scene,
        depth,
        "start",
        lambda name: _hold_frame_pose(stage.motion.poses(name)[0]),
    )
    entries = list_goal_entries(stage, run, depth) + [
        part for part in starts if _is_moving_part(stage, part)
    ]
    if belief is not None:
        believed = build_solid_entries(
            stage, belief, depth, "belief", lambda name: _move_frame_in_belief(belief, name)
        )
        entries += [part for part in believed if _is_displaced_part(stage, part)]
    if stage.motion.second is not None:
        second = build_solid_entries(
            stage, stage.motion.second.scene, depth, "second", _move_frame_in_second
        )
        entries += [part for part in second if _is_moving_part(stage, part)]
    return entries


def list_goal_entries(stage: RecordingFrames, run: xr.Dataset, depth: float) -> list[Entry]:
    """Return the outlines of the bodies at the goal that is stored in a run."""
    scene, _ = stage.motion.phases[-1]
    return [
        {
            "frame": stage.frame(name, "goal", _hold_frame_pose(scene.display.matrix @ T.matrix)),
            "label": f"goal of {wire.label}",
            "color": palette.GOAL,
            **add_shape_arrays(stage, wire),
        }
        for name, T in goal_outlines.read_goal_pose(run).items()
        for wire in goal_outlines.build_frame_outline(scene, name, depth)
    ]


def list_trail_entries(stage: RecordingFrames) -> list[Entry]:
    """Return the frames of the moving cameras and objects, with the colours of their paths."""
    colors = cycle([palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.GREEN])
    frames = [stage.frame(name) for name in list_cameras_and_objects(stage.motion.scene)]
    along = [frame for frame in frames if np.ptp(stage.track(frame)[:, :3], axis=0).max() > STILL]
    return [{"frame": i, "color": color} for i, color in zip(along, colors, strict=False)]


def _hold_frame_pose(T: Array) -> PosesOf:
    """Return a function that returns the poses of a frame at rest at T (4, 4)."""
    return lambda motion: np.repeat(T[None], motion.count, axis=0)


def _move_frame_in_belief(belief: Scene, name: str) -> PosesOf:
    """Return a function that returns the poses of a frame in the believed scene."""
    return lambda motion: np.concatenate(
        [compute_display_pose(belief, name, q) for _, q in motion.phases]
    )


def _move_frame_in_second(name: str) -> PosesOf:
    """Return a function that returns the poses of a frame under the second scheme."""

    def poses(motion: SceneMotion) -> Array:
        assert motion.second is not None
        return motion.second.poses(name)

    return poses


def _is_moving_part(stage: RecordingFrames, part: Entry) -> bool:
    """Return whether the true frame of a part moves."""
    true = _find_true_poses(stage, part)
    return true is not None and bool(np.ptp(true, axis=0).max() > STILL)


def _is_displaced_part(stage: RecordingFrames, part: Entry) -> bool:
    """Return whether a part is displaced from its true frame."""
    true = _find_true_poses(stage, part)
    return true is None or bool(np.abs(stage.track(part["frame"]) - true).max() > STILL)


def _find_true_poses(stage: RecordingFrames, part: Entry) -> Array | None:
    """Return the true poses (T, 7) of the frame of a part, or None if there is no such frame."""
    name, _ = list(stage.frames)[part["frame"]]
    return stage.track(stage.frame(name)) if (name, "true") in stage.frames else None
