"""Text form of poses: a position and at most one of three rotations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base import si_units
from robsim.declare import ListOf, Number, PerRun, Table, Vector
from robsim.declare.context import Context, NoTextError
from robsim.declare.problems import prefix_path
from robsim.geometry.pose import Pose, check_single_pose
from robsim.geometry.rotation import rotation_to_rpy

ROTATION_ROWS = ListOf(ListOf(Number(), 3, 3), 3, 3)


@dataclass(frozen=True)
class PoseTable:
    """Text form of a pose: a position, and a rotation in at most one of three forms."""

    stands: ClassVar[Mapping[str, str]] = {
        key: key for key in ("position", "rpy", "rotvec", "rotation")
    }
    rivals: ClassVar[Any] = ((("rpy",), ("rotvec",), ("rotation",)),)

    position: Annotated[
        ArrayLike | None, Vector("length"), PerRun((3,)), "Position of the origin."
    ] = None
    rpy: Annotated[
        ArrayLike | None,
        Vector("angle"),
        PerRun((3,)),
        "Roll, pitch and yaw: R = Rz(yaw) Ry(pitch) Rx(roll).",
    ] = None
    rotvec: Annotated[
        ArrayLike | None,
        Vector("angle"),
        PerRun((3,)),
        "Rotation vector: the unit axis times the angle.",
    ] = None
    rotation: Annotated[
        ArrayLike | None, ROTATION_ROWS, PerRun((3, 3)), "Rotation matrix, row by row."
    ] = None

    @classmethod
    def of(cls, value: Pose, c: Context) -> PoseTable:
        """Return the table of a pose; a position at the origin and no rotation are left out."""
        T = value.matrix
        if T.ndim > 2:
            raise NoTextError(f"a text holds one pose, not a batch of shape {T.shape[:-2]}")
        if c.facts.get("by_hand"):
            return cls(value.position, rotvec=value.rotvec)
        keeps_defaults = c.facts.get("changes")  # a list of changes states default values too
        displaced = value.position.tobytes() != np.zeros(3).tobytes()  # by bits: -0.0 is not 0.0
        position = value.position if displaced or keeps_defaults else None
        if value.rotation.tobytes() == np.eye(3).tobytes() and not keeps_defaults:
            return cls(position)
        angles = find_exact_angles(value) if c.facts.get("short") else None
        key, numbers = angles or ("rotation", value.rotation.tolist())
        return cls(position, **{key: numbers})

    def build_value(self, c: Context) -> Pose:
        """Return the pose that the table describes."""
        T = np.eye(4)
        if self.rotation is not None:
            T[:3, :3] = self.rotation
        elif self.rpy is not None or self.rotvec is not None:
            T = np.array(
                Pose.at(rpy=(0, 0, 0) if self.rpy is None else self.rpy, rotvec=self.rotvec)
            )
        if self.position is not None:
            T[:3, 3] = self.position
        with prefix_path("rotation"):
            return Pose(T)


@dataclass(frozen=True)
class PoseSpec(Table):
    """Declaration of a pose: a table, or keys of the surrounding table if `flat`."""

    kind: type[Any] = Pose
    says: type[Any] | None = PoseTable
    phrase: ClassVar[str] = "a pose: position, and one of rpy, rotvec and rotation"
    python_phrase: ClassVar[str] = "a Pose"

    def check(self, value: Any, what: str) -> Pose:
        return check_single_pose(value, what)

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        return [] if value is None else super().parts(keys, value, c)


POSE, FLAT_POSE = PoseSpec(), PoseSpec(flat=True)


ANGLE_DIGITS = 9  # decimals of the angles that are tried, in degrees or radians


def find_exact_angles(T: Pose) -> tuple[str, tuple[float, ...]] | None:
    """Return ("rpy" or "rotvec", angles) that reproduce a rotation bit for bit, or None.

    >>> find_exact_angles(Pose.at(rpy=(0.0, 0.5, 0.0)))
    ('rpy', (0.0, 0.5, 0.0))
    """
    target = T.rotation.tobytes()
    for key, angles, pose in propose_short_poses(T):
        if pose.rotation.tobytes() == target:
            return key, angles
    return None


def propose_short_poses(T: Pose) -> Iterator[tuple[str, tuple[float, ...], Pose]]:
    """Yield ("rpy" or "rotvec", angles) and their pose: a pose and its neighbours of short angles.

    The angles are rounded in degrees, then rounded in radians, and at last unrounded.
    """
    exact: dict[str, Any] = {"rpy": rotation_to_rpy(T.rotation), "rotvec": T.rotvec}
    for unit, digits in ((si_units.deg, 9), (si_units.rad, 9), (si_units.rad, 99)):
        for key, angles in exact.items():
            short = tuple(round(float(x) / unit, digits) * float(unit) + 0.0 for x in angles)
            rotation: Any = {key: short}
            yield key, short, Pose.at(*T.position, **rotation)
