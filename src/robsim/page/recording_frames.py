"""Frames of a recording, and solids as triangles and edges in these frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import methodcaller
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.page.body_shapes import BodyShapes
from robsim.plot.scene_motion import STILL, SceneMotion
from robsim.plot.wireframe import ScenePart
from robsim.world.scene import Scene

Entry = dict[str, Any]  # entry of the header of a recording; Any: JSON
FrameKey = tuple[str, str]  # name and group
PosesOf = Callable[[SceneMotion], Array]  # the poses (T, 4, 4) of a frame


class RecordingFrames:
    """Frames of a recording, the motion of each, and the shapes of its solids.

    `former` are the frames of a recording before a change: they keep their numbers, so that rows
    of poses before and after the change have the same columns. Frames that are not used any more
    have the pose NaN.

    Attributes
    ----------
    motion : SceneMotion
        Motion of the frames.
    shapes : BodyShapes
        Shapes of the bodies.
    live : bool
        Whether the motion goes on: then a frame moves if a robot can move it.
    """

    def __init__(
        self, motion: SceneMotion, shapes: BodyShapes, former: Iterable[FrameKey], live: bool
    ) -> None:
        self.motion, self.shapes, self.live = motion, shapes, live
        self._poses: dict[FrameKey, PosesOf | None] = dict.fromkeys(former)  # None: not used
        self._numbers = {key: number for number, key in enumerate(self._poses)}

    def add_frame(
        self, name: str, group: str = "true", of: Callable[[str], PosesOf] | None = None
    ) -> int:
        """Return the number of a frame, after adding it if it is new.

        `of` maps the name of the frame to a function that returns its poses (T, 4, 4) in a motion.
        By default, these are the poses of the frame in the scene.
        """
        key = name, group
        if self._poses.get(key) is None:
            self._poses[key] = of(name) if of else methodcaller("poses", name)
        return self._numbers.setdefault(key, len(self._numbers))

    @property
    def keys(self) -> list[FrameKey]:
        """Name and group of each frame."""
        return list(self._poses)

    @property
    def frame_entries(self) -> list[Entry]:
        """The frames in their order, as entries of a header."""
        return [{"name": name, "group": group} for name, group in self._poses]

    def compute_poses(self, motion: SceneMotion) -> Array:
        """Return the poses (T, frames, 7) of all frames."""
        numbers = np.full((motion.count, len(self._poses), 7), np.nan)
        tracks = {i: poses(motion) for i, poses in enumerate(self._poses.values()) if poses}
        if tracks:
            together = np.stack(list(tracks.values()), axis=1)
            numbers[:, list(tracks)] = convert_poses_to_numbers(together)
        return numbers

    def has_frame(self, name: str) -> bool:
        """Return whether the scene has a frame of this name in the recording."""
        return (name, "true") in self._poses

    def is_moving(self, name: str) -> bool:
        """Return whether a frame of the scene moves."""
        if self.live:
            return bool(self.motion.scene.tree.flag_moves(name).any())
        return bool(np.ptp(self.motion.poses(name), axis=0).max() > STILL)


def convert_poses_to_numbers(T: Array) -> Array:
    """Return poses (T, ..., 4, 4) as x, y, z and unit quaternion x, y, z, w, continuous in sign."""
    pose = Pose(T)
    quaternion = pose.quaternion
    leaps = np.sum(quaternion[1:] * quaternion[:-1], axis=-1) < 0
    signs = np.cumprod(
        np.concatenate([np.ones((1, *leaps.shape[1:])), np.where(leaps, -1.0, 1.0)]), axis=0
    )
    return np.concatenate([pose.position, quaternion * signs[..., None]], axis=-1)


def build_solid_entries(
    frames: RecordingFrames,
    scene: Scene,
    depth: float,
    group: str,
    of: Callable[[str], PosesOf] | None = None,
    shown: Callable[[str], bool] | None = None,
) -> list[Entry]:
    """Return the parts of a scene as entries of a header.

    `of` maps the name of a frame to a function that returns its poses. By default, these are the
    poses of the frame in the shown scene. `shown` selects the frames with parts by their names.
    """
    parts = frames.shapes.list_scene_parts(scene, depth)
    names = dict.fromkeys(part.frame for part in parts)
    chosen = {name for name in names if shown is None or shown(name)}
    return [_build_solid_entry(frames, part, group, of) for part in parts if part.frame in chosen]


def _build_solid_entry(
    frames: RecordingFrames, part: ScenePart, group: str, of: Callable[[str], PosesOf] | None
) -> Entry:
    """Return the entry of a solid, or of a line between two frames."""
    start = frames.add_frame(part.frame, group, of)
    entry = {"frame": start, "label": part.wire.label, "color": part.wire.color}
    if part.to:
        return {**entry, "to": frames.add_frame(part.to, group, of)}
    entry |= {**frames.shapes.store_solid(part.wire), "sheer": part.wire.transparent}
    pictures = [frames.shapes.store_picture(each) for each in part.wire.pictures]
    return {**entry, **({"pictures": pictures} if pictures and group == "true" else {})}
