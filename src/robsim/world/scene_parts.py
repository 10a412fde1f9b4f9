"""Functions that find the parts of a scene by name, and that check its coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.robot.robot import Robot
from robsim.robot.robot_coordinates import Coordinates
from robsim.world.motion import Motion
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object

T = TypeVar("T", Robot, Object, MountedCamera, Motion)
Configuration = Coordinates | Mapping[str, Coordinates]  # (..., nq), or {robot: its coordinates}
PART_TYPES: dict[str, type[Any]] = {
    "robots": Robot,
    "objects": Object,
    "cameras": MountedCamera,
    "motions": Motion,
}


def find_part(parts: Sequence[T], name: str | None, kind: str) -> T:
    """Return the part with a name, or the only part; raise InputError if there is no such part."""
    names = [p.name for p in parts]
    if name is None and not parts:
        lack = " with marks" if kind == "object" else ""
        raise InputError(f"the scene has no {kind}{lack}")
    if name is None and len(parts) == 1:
        return parts[0]
    if name is None:
        raise InputError(f"name the {kind}: the scene has {len(parts)} ({', '.join(names)})")
    if not is_known_name(name, names):
        raise InputError(
            f"no {kind} {format_value(name)} in the scene; {suggest_names(name, names, kind + 's')}"
        )
    return parts[names.index(name)]


def replace_part(parts: dict[str, list[Any]], part: Any) -> None:
    """Replace the part with the same name and kind; raise InputError if there is no such part."""
    kind = next((kind for kind in PART_TYPES if isinstance(part, PART_TYPES[kind])), None)
    if kind is None:
        raise InputError(
            f"expected a Robot, Object, MountedCamera or Motion, got {format_value(part)}"
        )
    known = [p.name for p in parts[kind]]
    if part.name not in known:
        raise InputError(
            f"the scene has no {kind[:-1]} '{part.name}' to replace; "
            f"{suggest_names(part.name, known, kind)}"
        )
    parts[kind][known.index(part.name)] = part


def parse_coordinates(robots: Sequence[Robot], q: Configuration, what: str, limits: bool) -> Array:
    """Return checked coordinates (..., nq) of all robots, from an array or {robot: q}."""
    if isinstance(q, Mapping):
        return _concatenate_coordinates(
            [r.coordinates(q.get(r.name, r.home), what, limits) for r in robots], what
        )
    if len(robots) == 1:
        return robots[0].coordinates(q, what, limits)
    values = as_floats(cast(ArrayLike, q), what, (sum(robot.nq for robot in robots),))
    start = 0
    for robot in robots:
        robot.coordinates(values[..., start : start + robot.nq], what, limits)
        start += robot.nq
    return values


def _concatenate_coordinates(parts: Sequence[Array], what: str) -> Array:
    """Return parts (..., n) broadcast to a common leading shape and concatenated, (..., nq)."""
    sizes = [p.shape[:-1] for p in parts]
    try:
        lead = np.broadcast_shapes(*sizes)
    except ValueError:
        raise InputError(f"{what}: batches of unequal shapes {sizes}") from None
    wide = [np.broadcast_to(p, (*lead, p.shape[-1])) for p in parts]
    return np.concatenate([np.empty((*lead, 0)), *wide], -1)
