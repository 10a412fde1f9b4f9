"""The solids of a scene as a page draws them: triangles and edges on frames that move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from operator import methodcaller
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.plot.scene_motion import SceneMotion
from robsim.plot.wireframe import ScenePart, WireSolid, list_scene_parts
from robsim.world.scene import Scene

Entry = dict[str, Any]  # of a header
PosesOf = Callable[[SceneMotion], Array]  # (T, 4, 4)


@dataclass
class RecordingFrames:
    """The frames of a recording, how each moves, and the arrays of its solids.

    By `moving` it is found which of them move.
    """

    moving: SceneMotion
    frames: dict[tuple[str, str], PosesOf] = field(default_factory=dict)  # by name and group
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)

    def frame(self, name: str, group: str = "true", poses: PosesOf | None = None) -> int:
        """Return the number of a frame, whose poses are those of its name if not given."""
        if (name, group) not in self.frames:
            self.frames[name, group] = poses or methodcaller("poses", name)
        return list(self.frames).index((name, group))

    @property
    def listed(self) -> list[dict[str, str]]:
        """The frames in their order, as entries of a header."""
        return [{"name": name, "group": group} for name, group in self.frames]

    def track(self, number: int) -> Array:
        """Return the poses (T, 7) of a frame."""
        return convert_poses_to_numbers(list(self.frames.values())[number](self.moving))

    def poses(self, moving: SceneMotion) -> Array:
        """Return the poses (T, frames, 7) of all frames."""
        tracks = [convert_poses_to_numbers(poses(moving)) for poses in self.frames.values()]
        return np.stack(tracks, axis=1) if tracks else np.zeros((moving.count, 0, 7))

    def array(self, name: str, values: Any) -> str:
        """Keep an array under a name, and return that."""
        self.arrays[name] = np.asarray(values)
        return name


def convert_poses_to_numbers(T: Array) -> Array:
    """Return x, y, z and the unit quaternion x, y, z, w (T, 7) of poses, without leaps of sign."""
    found = Pose(T)
    quaternion = found.quaternion
    leaps = np.sum(quaternion[1:] * quaternion[:-1], axis=-1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))
    return np.concatenate([found.position, quaternion * signs[:, None]], axis=-1)


def build_solid_entries(
    stage: RecordingFrames, scene: Scene, depth: float, group: str, of: Any = None
) -> list[Entry]:
    """Return the parts of a scene as entries of a header.

    `of` returns how a frame of a name moves, where that is not as in the scene that is shown.
    """
    return [_build_solid_entry(stage, part, group, of) for part in list_scene_parts(scene, depth)]


def _build_solid_entry(stage: RecordingFrames, part: ScenePart, group: str, of: Any) -> Entry:
    place, there = (
        stage.frame(name, group, of and of(name)) if name else None
        for name in (part.frame, part.to)
    )
    entry = {"frame": place, "label": part.wire.label, "color": part.wire.color}
    if part.to:
        return {**entry, "to": there}
    return {**entry, **add_shape_arrays(stage, part.wire), "sheer": part.wire.sheer}


def add_shape_arrays(stage: RecordingFrames, wire: WireSolid) -> Entry:
    """Return the names of the arrays of a solid: corners of its triangles, and its edges.

    Its faces are convex.
    """
    key = f"shape{len(stage.arrays)}"
    fans = [face[[0, i, i + 1]] for face in wire.faces for i in range(1, len(face) - 1)]
    corners = np.array(fans).reshape(-1, 3)
    return {
        "triangles": stage.array(f"{key}.triangles", corners),
        "edges": stage.array(f"{key}.edges", wire.segments.reshape(-1, 3)),
    }
