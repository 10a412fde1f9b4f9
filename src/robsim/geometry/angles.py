"""Angles of which a rotation was made, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from robsim.base import si_units
from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.geometry.rotation import rotation_to_rpy

ANGLE_DIGITS = 9  # of numbers in degrees or radians that a person gives


def find_exact_angles(T: Pose) -> tuple[str, tuple[float, ...]] | None:
    """Return ("rpy" or "rotvec", angles) that give this very rotation; None if none are found.

    >>> find_exact_angles(Pose.at(rpy=(0.0, 0.5, 0.0)))
    ('rpy', (0.0, 0.5, 0.0))
    """
    wanted = T.rotation.tobytes()
    for key in ("rpy", "rotvec"):
        for given in _propose_angles(rotation_to_rpy(T.rotation) if key == "rpy" else T.rotvec):
            turn: Any = {key: given}
            if Pose.at(**turn).rotation.tobytes() == wanted:
                return key, given
    return None


def _propose_angles(angles: Array | tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    """Yield angles of few digits in degrees, of few digits in radians, and as they are."""
    for unit in (si_units.deg, si_units.rad):
        yield tuple(round(float(x) / unit, ANGLE_DIGITS) * float(unit) + 0.0 for x in angles)
    yield tuple(map(float, angles))
