"""Denavit-Hartenberg rows as joints."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.rotation import axis_rotation


def dh_constants(row: Array, convention: str, kind: str) -> tuple[Pose, Pose]:
    """(place, tail) of a DH row, so that the joint is place . motion(q) . tail."""
    theta, d, a, alpha = row
    turn, rise = _rigid(axis_rotation("z", theta)), Pose.at(0, 0, d)
    reach = Pose.at(a, 0, 0) @ _rigid(axis_rotation("x", alpha))
    if convention == "standard":
        return (turn, rise @ reach) if kind == "revolute" else (turn @ rise, reach)
    if convention == "modified":
        return (reach @ turn, rise) if kind == "revolute" else (reach @ turn @ rise, IDENTITY)
    raise InputError(f"DH convention must be 'standard' or 'modified', got {convention!r}")


def _rigid(R: Array) -> Pose:
    T = np.eye(4)
    T[:3, :3] = R
    return Pose(T)
