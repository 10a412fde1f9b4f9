"""Rows of a Denavit-Hartenberg table, and the constants of a joint that follow from a row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Angle, DeclaredValue, Length, PerRun, Word, described
from robsim.declare.context import Context, Raw
from robsim.geometry.pose import Pose
from robsim.geometry.rotation import axis_rotation

DH_CONVENTIONS = ("standard", "modified")


@dataclass(frozen=True)
class DHConvention(Word):
    """Declaration of the convention of a row, given once for all rows of a robot or for one row."""

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        """Return the convention of the row, or the convention of the robot around it."""
        if name not in table:
            return c.facts.get("convention", "standard")
        return super().pick(table, name, c)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        """Write the convention if it differs from the convention of the robot around the row."""
        if value != c.facts.get("convention", "standard"):
            super().put(table, name, value, c)


ROW_CONVENTION = DHConvention(DH_CONVENTIONS, "convention")


@described
@dataclass(frozen=True, eq=False)
class DHRow(DeclaredValue):
    """Row of a Denavit-Hartenberg table.

    The row determines the constants of a `Joint`. The coordinate of the joint is added to theta if
    it turns, and to d if it slides. The order of the transforms is Rz(theta) Tz(d) Tx(a) Rx(alpha)
    in the standard convention, and Rx(alpha) Tx(a) Rz(theta) Tz(d) in the modified convention
    (Craig). A constant that is left out is zero.

    Examples
    --------
    >>> DHRow(0.0, 0.1, 0.5, 0.0).constants(turns=True)[1].position
    array([0.5, 0. , 0.1])
    """

    without_controls: ClassVar[tuple[str, ...]] = ("convention",)  # it describes another robot

    theta: Annotated[float, Angle(), PerRun(()), "Rotation about z."] = 0.0
    d: Annotated[float, Length(), PerRun(()), "Translation along z."] = 0.0
    a: Annotated[float, Length(), PerRun(()), "Translation along x."] = 0.0
    alpha: Annotated[float, Angle(), PerRun(()), "Rotation about x."] = 0.0
    convention: Annotated[
        str, ROW_CONVENTION, "Order of the transforms. None: as in the robot."
    ] = "standard"

    def constants(self, turns: bool) -> tuple[Pose, Pose]:
        """Return the constant poses of a joint with this row.

        Parameters
        ----------
        turns : bool
            Whether the joint turns about z. Otherwise it slides along z.

        Returns
        -------
        place, tail : Pose
            Poses before and after the motion of the joint: T = place @ motion(q) @ tail.
        """
        row = np.broadcast_arrays(self.theta, self.d, self.a, self.alpha)
        return compute_dh_constants(np.stack(row, axis=-1), self.convention, turns)


def compute_dh_constants(row: Array, convention: str, turns: bool) -> tuple[Pose, Pose]:
    """Return (place, tail) of DH rows (..., 4), with the joint place @ motion(q) @ tail."""
    theta, d, a, alpha = row[..., 0], row[..., 1], row[..., 2], row[..., 3]
    turn, rise = _elementary_transform("z", angle=theta), _elementary_transform("z", distance=d)
    reach = _elementary_transform("x", distance=a) @ _elementary_transform("x", angle=alpha)
    if convention == "standard":
        place, tail = (turn, rise @ reach) if turns else (turn @ rise, reach)
    else:
        place, tail = (reach @ turn, rise) if turns else (reach @ turn @ rise, np.eye(4))
    return Pose(place), Pose(tail)


def _elementary_transform(axis: str, angle: Any = None, distance: Any = None) -> Array:
    """Return the transform (..., 4, 4) that turns about an axis, or moves along it."""
    T = np.zeros((*np.shape(distance if angle is None else angle), 4, 4))
    T[..., range(4), range(4)] = 1.0
    if angle is None:
        T[..., "xyz".index(axis), 3] = distance
    else:
        T[..., :3, :3] = axis_rotation(axis, angle)
    return T


def pose_from_rotation(R: Array) -> Pose:
    """Return poses at the origin with rotations (..., 3, 3); raise InputError for others."""
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3], T[..., 3, 3] = R, 1.0
    return Pose(T)
