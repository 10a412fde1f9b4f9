"""The solids of a scene as a page draws them: triangles and edges on frames that move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.plot.moving import Moving
from robsim.plot.wireframe import Part, Wire, parts


@dataclass
class Stage:
    """The frames of a recording with their poses over time, and its arrays."""

    frames: dict[tuple[str, str], int] = field(default_factory=dict)  # by name and group
    poses: list[Array] = field(default_factory=list)  # (T, 7) of each frame
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)

    def frame(self, name: str, group: str, poses: Callable[[], Array]) -> int:
        """Return the number of a frame; its poses (T, 4, 4) are asked for when it is new."""
        if (name, group) not in self.frames:
            self.frames[name, group] = len(self.poses)
            self.poses.append(_numbers(poses()))
        return self.frames[name, group]

    @property
    def listed(self) -> list[dict[str, str]]:
        """The frames in their order, as entries of a header."""
        return [{"name": name, "group": group} for name, group in self.frames]

    def array(self, name: str, values: Any) -> str:
        """Keep an array under a name, and return that."""
        self.arrays[name] = np.asarray(values)
        return name


def _numbers(T: Array) -> Array:
    """Return x, y, z and the unit quaternion x, y, z, w (T, 7) of poses, without leaps of sign."""
    found = Pose(T)
    quaternion = found.quaternion
    leaps = np.sum(quaternion[1:] * quaternion[:-1], axis=-1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))
    return np.concatenate([found.position, quaternion * signs[:, None]], axis=-1)


def solids(stage: Stage, moving: Moving, depth: float, group: str) -> list[dict[str, Any]]:
    """Return the parts of a scene over time, as entries of a header."""
    return [_entry(stage, moving, part, group) for part in parts(moving.scene, depth)]


def _entry(stage: Stage, moving: Moving, part: Part, group: str) -> dict[str, Any]:
    place = stage.frame(part.frame, group, partial(moving.poses, part.frame))
    entry = {"frame": place, "label": part.wire.label, "color": part.wire.color}
    if part.to:
        return {**entry, "to": stage.frame(part.to, group, partial(moving.poses, part.to))}
    return {**entry, **shape(stage, part.wire), "sheer": part.wire.sheer}


def shape(stage: Stage, wire: Wire) -> dict[str, Any]:
    """Return the names of the arrays of a solid: corners of its triangles, and its edges."""
    key = f"shape{len(stage.arrays)}"
    triangles = [fan for face in wire.faces for fan in _fan(face)]
    corners = np.array(triangles).reshape(-1, 3)
    return {
        "triangles": stage.array(f"{key}.triangles", corners),
        "edges": stage.array(f"{key}.edges", wire.segments.reshape(-1, 3)),
    }


def _fan(face: Array) -> list[Array]:
    """Return the triangles of a face (n, 3) that is convex."""
    return [np.stack([face[0], face[i], face[i + 1]]) for i in range(1, len(face) - 1)]
