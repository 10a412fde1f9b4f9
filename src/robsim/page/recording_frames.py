"""Frames of a recording, and solids as triangles and edges in these frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from operator import methodcaller
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.plot.scene_motion import SceneMotion
from robsim.plot.wireframe import ScenePart, WireSolid, list_scene_parts
from robsim.world.scene import Scene

Entry = dict[str, Any]  # entry of the header of a recording; Any: JSON
PosesOf = Callable[[SceneMotion], Array]  # the poses (T, 4, 4) of a frame


@dataclass
class RecordingFrames:
    """Frames of a recording, the motion of each, and the arrays of its solids.

    Attributes
    ----------
    motion : SceneMotion
        Motion of the frames.
    frames : dict
        Functions that return the poses (T, 4, 4) of a frame in a motion, by (name, group).
    arrays : dict
        Arrays by name.
    """

    motion: SceneMotion
    frames: dict[tuple[str, str], PosesOf] = field(default_factory=dict)  # keys: (name, group)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)

    def add_frame(self, name: str, group: str = "true", poses: PosesOf | None = None) -> int:
        """Return the number of a frame, after adding it if it is new.

        `poses` returns the poses (T, 4, 4) of the frame in a motion; by default, the poses of the
        frame `name` of the scene.
        """
        if (name, group) not in self.frames:
            self.frames[name, group] = poses or methodcaller("poses", name)
        return list(self.frames).index((name, group))

    @property
    def frame_entries(self) -> list[dict[str, str]]:
        """The frames in their order, as entries of a header."""
        return [{"name": name, "group": group} for name, group in self.frames]

    def compute_track(self, number: int) -> Array:
        """Return the poses (T, 7) of a frame."""
        return convert_poses_to_numbers(list(self.frames.values())[number](self.motion))

    def compute_poses(self, motion: SceneMotion) -> Array:
        """Return the poses (T, frames, 7) of all frames."""
        tracks = [convert_poses_to_numbers(poses(motion)) for poses in self.frames.values()]
        return np.stack(tracks, axis=1) if tracks else np.zeros((motion.count, 0, 7))

    def store_array(self, name: str, values: ArrayLike) -> str:
        """Store an array under a name, and return the name."""
        self.arrays[name] = np.asarray(values)
        return name


def convert_poses_to_numbers(T: Array) -> Array:
    """Return poses as x, y, z and unit quaternion x, y, z, w (T, 7), continuous in sign."""
    pose = Pose(T)
    quaternion = pose.quaternion
    leaps = np.sum(quaternion[1:] * quaternion[:-1], axis=-1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))
    return np.concatenate([pose.position, quaternion * signs[:, None]], axis=-1)


def build_solid_entries(
    frames: RecordingFrames,
    scene: Scene,
    depth: float,
    group: str,
    of: Callable[[str], PosesOf] | None = None,
) -> list[Entry]:
    """Return the parts of a scene as entries of a header.

    `of` maps the name of a frame to a function that returns its poses. By default, these are the
    poses of the frame in the shown scene.
    """
    return [_build_solid_entry(frames, part, group, of) for part in list_scene_parts(scene, depth)]


def _build_solid_entry(
    frames: RecordingFrames, part: ScenePart, group: str, of: Callable[[str], PosesOf] | None
) -> Entry:
    """Return the entry of a solid, or of a line between two frames."""
    start, end = (
        frames.add_frame(name, group, of(name) if of else None) if name else None
        for name in (part.frame, part.to)
    )
    entry = {"frame": start, "label": part.wire.label, "color": part.wire.color}
    if part.to:
        return {**entry, "to": end}
    return {**entry, **add_shape_arrays(frames, part.wire), "sheer": part.wire.transparent}


def add_shape_arrays(frames: RecordingFrames, wire: WireSolid) -> Entry:
    """Return the names of the arrays of a solid: the corners of its triangles, and its edges.

    The faces must be convex.
    """
    key = f"shape{len(frames.arrays)}"
    fans = [face[[0, i, i + 1]] for face in wire.faces for i in range(1, len(face) - 1)]
    corners = np.array(fans).reshape(-1, 3)
    return {
        "triangles": frames.store_array(f"{key}.triangles", corners),
        "edges": frames.store_array(f"{key}.edges", wire.segments.reshape(-1, 3)),
    }
