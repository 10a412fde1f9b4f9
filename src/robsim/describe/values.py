"""Numbers and poses as a file says them, with all their digits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import numpy as np

from robsim.geometry.pose import Pose

Table = dict[str, Any]
V = TypeVar("V")


class NoDescription(Exception):
    """This is made of somebody's Python code, which a file cannot hold."""


def quantity(number: float, unit: str) -> str:
    """'0.1 m'; a text of a bare number where the unit is "1"."""
    return f"{float(number)!r} {unit}" if unit != "1" else repr(float(number))


def length(*metres: float) -> str:
    """'0.1, 0.2 m'."""
    return listed(metres, "m")


def listed(numbers: Iterable[float], unit: str) -> str:
    """'0.1, 0.2 kg m^2'."""
    return f"{', '.join(repr(float(x)) for x in numbers)} {unit}"


def coordinates(q: Any, units: Iterable[str]) -> list[str]:
    """Coordinates or velocities, each number with its unit."""
    return [quantity(x, u) for x, u in zip(q, units, strict=True)]


def pose(value: Pose) -> Table:
    """position and rotation; nothing for what is the identity."""
    table: Table = {}
    if not _same(value.position, np.zeros(3)):
        table["position"] = length(*value.position)
    if not _same(value.rotation, np.eye(3)):
        table["rotation"] = value.rotation.tolist()
    return table


def builtin(known: Mapping[str, type[Any]], value: Any) -> str:
    """The name of a value's class among ours; NoDescription if it is somebody's own."""
    for name, kind in known.items():
        if type(value) is kind:
            return name
    raise NoDescription(f"{type(value).__name__} is Python code")


def ours(value: V, *kinds: type[Any]) -> V:
    """The value, if it is of one of these classes itself; NoDescription if it is somebody's own."""
    if type(value) not in kinds and not isinstance(value, str):
        raise NoDescription(f"{type(value).__name__} is Python code")
    return value


def _same(a: Any, b: Any) -> bool:
    """Bit for bit: -0.0 is not 0.0."""
    return bool(np.asarray(a).tobytes() == np.asarray(b).tobytes())
