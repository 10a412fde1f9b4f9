"""Library robot or file that a robot was read from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RobotOrigin:
    """Name of a library robot, or absolute path of a URDF file."""

    model: str | None = None
    urdf: str | None = None


ORIGIN_KEYS = {
    "model": "Name of a robot of the library.",
    "urdf": "Path of a URDF file, relative to this file.",
}
