"""Outlines of the goal, the start, the believed scene and the second scheme; trails of motion."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.page.recording_frames import Entry, PosesOf, RecordingFrames, build_solid_entries
from robsim.plot import goal_outlines, palette
from robsim.plot.scene_motion import STILL, SceneMotion, list_cameras_and_objects
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.plot.run_data import RunVariables


def list_outline_entries(
    frames: RecordingFrames, belief: Scene | None, run: RunVariables, depth: float
) -> list[Entry]:
    """Return the outlines of the goal, the start, displaced believed bodies and second scheme."""
    scene, second = frames.motion.scene, frames.motion.second
    entries = list_goal_entries(frames, run, depth)
    entries += build_solid_entries(
        frames,
        scene,
        depth,
        "start",
        lambda name: _hold_pose(frames.motion.poses(name)[0])(name),
        frames.is_moving,
    )
    if belief is not None:
        entries += build_solid_entries(
            frames,
            belief,
            depth,
            "belief",
            lambda name: lambda motion: motion.within(belief).poses(name),
            lambda name: _is_displaced(frames, belief, name),
        )
    if second is not None:
        entries += build_solid_entries(
            frames, second.scene, depth, "second", _move_frame_in_second, frames.is_moving
        )
    return entries


def list_goal_entries(frames: RecordingFrames, run: RunVariables, depth: float) -> list[Entry]:
    """Return the outlines of the bodies at the goal that is stored in a run."""
    scene, _ = frames.motion.phases[-1]
    shapes = frames.shapes
    return [
        {
            "frame": frames.add_frame(name, "goal", _hold_pose(scene.display.matrix @ T.matrix)),
            "label": f"goal of {wire.label}",
            "color": palette.GOAL,
            **shapes.store_solid(wire),
        }
        for name, T in goal_outlines.read_goal_pose(run).items()
        for wire in shapes.list_frame_outline(scene, name, depth)
    ]


def list_trail_entries(frames: RecordingFrames) -> list[Entry]:
    """Return the frames of the moving cameras and objects, with the colours of their paths.

    The paths under a second scheme follow, each in the colour of the second scheme.
    """
    colors = cycle([palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.GREEN])
    bodies = list_cameras_and_objects(frames.motion.scene)
    moving = [name for name in bodies if frames.is_moving(name)]
    for name in bodies:
        frames.add_frame(name)
    entries = [
        {"frame": frames.add_frame(name), "color": color}
        for name, color in zip(moving, colors, strict=False)
    ]
    if frames.motion.second is None:
        return entries
    return entries + [
        {"frame": frames.add_frame(name, "second", _move_frame_in_second), "color": palette.ORANGE}
        for name in moving
    ]


def _hold_pose(T: Array) -> Callable[[str], PosesOf]:
    """Return a function from a name to the poses of a frame at rest at T (4, 4)."""
    return lambda _: lambda motion: np.repeat(T[None], motion.count, axis=0)


def _move_frame_in_second(name: str) -> PosesOf:
    """Return a function that returns the poses of a frame under the second scheme."""

    def poses(motion: SceneMotion) -> Array:
        assert motion.second is not None
        return motion.second.poses(name)

    return poses


def _is_displaced(frames: RecordingFrames, belief: Scene, name: str) -> bool:
    """Return whether a believed frame is displaced from the true frame, or there is none."""
    if not frames.has_frame(name):
        return True
    motion = frames.motion
    return bool(np.abs(motion.within(belief).poses(name) - motion.poses(name)).max() > STILL)
