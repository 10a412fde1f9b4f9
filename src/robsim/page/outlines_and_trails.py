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
    frames: RecordingFrames, belief: Scene | None, run: xr.Dataset, depth: float
) -> list[Entry]:
    """Return the outlines of the goal, the start, displaced believed bodies and second scheme."""
    starts = build_solid_entries(
        frames,
        frames.motion.scene,
        depth,
        "start",
        lambda name: _hold_frame_pose(frames.motion.poses(name)[0]),
    )
    entries = list_goal_entries(frames, run, depth) + [
        part for part in starts if _is_moving_part(frames, part)
    ]
    if belief is not None:
        believed = build_solid_entries(
            frames, belief, depth, "belief", lambda name: _move_frame_in_belief(belief, name)
        )
        entries += [part for part in believed if _is_displaced_part(frames, part)]
    if frames.motion.second is not None:
        second = build_solid_entries(
            frames, frames.motion.second.scene, depth, "second", _move_frame_in_second
        )
        entries += [part for part in second if _is_moving_part(frames, part)]
    return entries


def list_goal_entries(frames: RecordingFrames, run: xr.Dataset, depth: float) -> list[Entry]:
    """Return the outlines of the bodies at the goal that is stored in a run."""
    scene, _ = frames.motion.phases[-1]
    return [
        {
            "frame": frames.add_frame(
                name, "goal", _hold_frame_pose(scene.display.matrix @ T.matrix)
            ),
            "label": f"goal of {wire.label}",
            "color": palette.GOAL,
            **add_shape_arrays(frames, wire),
        }
        for name, T in goal_outlines.read_goal_pose(run).items()
        for wire in goal_outlines.build_frame_outline(scene, name, depth)
    ]


def list_trail_entries(frames: RecordingFrames) -> list[Entry]:
    """Return the frames of the moving cameras and objects, with the colours of their paths."""
    colors = cycle([palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.GREEN])
    numbers = [frames.add_frame(name) for name in list_cameras_and_objects(frames.motion.scene)]
    moving = [
        frame
        for frame in numbers
        if np.ptp(frames.compute_track(frame)[:, :3], axis=0).max() > STILL
    ]
    return [{"frame": i, "color": color} for i, color in zip(moving, colors, strict=False)]


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


def _is_moving_part(frames: RecordingFrames, part: Entry) -> bool:
    """Return whether the true frame of a part moves."""
    true_poses = _find_true_poses(frames, part)
    return true_poses is not None and bool(np.ptp(true_poses, axis=0).max() > STILL)


def _is_displaced_part(frames: RecordingFrames, part: Entry) -> bool:
    """Return whether a part is displaced from its true frame."""
    true_poses = _find_true_poses(frames, part)
    return true_poses is None or bool(
        np.abs(frames.compute_track(part["frame"]) - true_poses).max() > STILL
    )


def _find_true_poses(frames: RecordingFrames, part: Entry) -> Array | None:
    """Return the true poses (T, 7) of the frame of a part, or None if there is no such frame."""
    name, _ = list(frames.frames)[part["frame"]]
    return frames.compute_track(frames.add_frame(name)) if (name, "true") in frames.frames else None
