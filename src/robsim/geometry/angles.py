"""Short angles that reproduce a rotation matrix bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from robsim.base import si_units
from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.geometry.rotation import rotation_to_rpy

ANGLE_DIGITS = 9  # decimals of the angles that are tried, in degrees or radians


def find_exact_angles(T: Pose) -> tuple[str, tuple[float, ...]] | None:
    """Return ("rpy" or "rotvec", angles) that reproduce a rotation bit for bit, or None.

    >>> find_exact_angles(Pose.at(rpy=(0.0, 0.5, 0.0)))
    ('rpy', (0.0, 0.5, 0.0))
    """
    target = T.rotation.tobytes()
    for key in ("rpy", "rotvec"):
        for angles in _propose_angles(rotation_to_rpy(T.rotation) if key == "rpy" else T.rotvec):
            rotation: Any = {key: angles}
            if Pose.at(**rotation).rotation.tobytes() == target:
                return key, angles
    return None


def _propose_angles(angles: Array | tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    """Yield the angles rounded in degrees, rounded in radians, and unrounded."""
    for unit in (si_units.deg, si_units.rad):
        yield tuple(round(float(x) / unit, ANGLE_DIGITS) * float(unit) + 0.0 for x in angles)
    yield tuple(map(float, angles))
