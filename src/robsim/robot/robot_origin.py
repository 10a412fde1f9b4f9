"""The library robot or the file that a robot was read from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RobotOrigin:
    """The name of a library robot, or the absolute path of a URDF file."""

    model: str | None = None
    urdf: str | None = None


ORIGIN_KEYS = {
    "model": "The name of a robot of the library.",
    "urdf": "The path of a URDF file from here.",
}
