"""Rows of a Denavit-Hartenberg table, and the constants of a joint that they give."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Angle, DeclaredValue, Length, PerRun, Word
from robsim.declare.spec import Context, Raw
from robsim.geometry.pose import Pose
from robsim.geometry.rotation import axis_rotation

DH_CONVENTIONS = ("standard", "modified")


@dataclass(frozen=True)
class DHConvention(Word):
    """The convention of a row, which a text says once for all rows of a robot, or in a row."""

    choices: tuple[str, ...] = DH_CONVENTIONS
    noun: str = "convention"

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        """Return the convention of the row, or that of the robot around it."""
        if name not in table:
            return c.facts.get("convention", "standard")
        return super().pick(table, name, c)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        """Write the convention where the robot around the row has another one."""
        if value != c.facts.get("convention", "standard"):
            super().put(table, name, value, c)

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        """Return nothing: another convention is another robot."""
        return ()


@dataclass(frozen=True, eq=False)
class DHRow(DeclaredValue):
    """A row of a Denavit-Hartenberg table, from which a `Joint` gets its constants.

    >>> DHRow(0.0, 0.1, 0.5, 0.0).constants(turns=True)[1].position
    array([0.5, 0. , 0.1])
    """

    theta: Annotated[float, Angle(), PerRun(()), PerRun(()), "Rotation about z."]
    d: Annotated[float, Length(), PerRun(()), "Translation along z."]
    a: Annotated[float, Length(), PerRun(()), "Translation along x."]
    alpha: Annotated[float, Angle(), PerRun(()), "Rotation about x."]
    convention: Annotated[str, DHConvention(), "Order of the four; None: that of the robot."] = (
        "standard"
    )

    def constants(self, turns: bool) -> tuple[Pose, Pose]:
        """Return (place, tail) of a joint that turns about z, or slides along it."""
        row = np.broadcast_arrays(self.theta, self.d, self.a, self.alpha)
        return compute_dh_constants(np.stack(row, axis=-1), self.convention, turns)


def compute_dh_constants(row: Array, convention: str, turns: bool) -> tuple[Pose, Pose]:
    """Return (place, tail) of a DH row (..., 4), so that the joint is place . motion(q) . tail."""
    theta, d, a, alpha = row[..., 0], row[..., 1], row[..., 2], row[..., 3]
    turn, rise = _elementary_transform("z", turned=theta), _elementary_transform("z", moved=d)
    reach = _elementary_transform("x", moved=a) @ _elementary_transform("x", turned=alpha)
    if convention == "standard":
        place, tail = (turn, rise @ reach) if turns else (turn @ rise, reach)
    else:
        place, tail = (reach @ turn, rise) if turns else (reach @ turn @ rise, np.eye(4))
    return Pose(place), Pose(tail)


def _elementary_transform(axis: str, turned: Any = None, moved: Any = None) -> Array:
    """Return the transform (..., 4, 4) that turns about an axis, or moves along it."""
    T = np.zeros((*np.shape(moved if turned is None else turned), 4, 4))
    T[..., range(4), range(4)] = 1.0
    if turned is None:
        T[..., "xyz".index(axis), 3] = moved
    else:
        T[..., :3, :3] = axis_rotation(axis, turned)
    return T


def pose_from_rotation(R: Array) -> Pose:
    """Return poses of rotations (..., 3, 3) at the origin; InputError if they are none."""
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., 3, 3] = R, 1.0
    return Pose(T)
