"""From the table of a link to its joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robsim.base.errors import InputError
from robsim.describe.joint import CURVES, FOLLOWS
from robsim.geometry.curves import Curve
from robsim.geometry.pose import Pose
from robsim.robot.dh import dh_constants
from robsim.robot.joint import KINDS, SINGLE, Coupling, Joint, Steering
from robsim.scenario import schema
from robsim.scenario.place import pose
from robsim.scenario.problems import under
from robsim.scenario.quantity import coordinate


def joint(table: schema.LinkTable, convention: str) -> Joint:
    """The joint of a link."""
    kind = table.joint
    return Joint(
        kind,
        *_constants(table, convention),
        None if table.limits is None else _limits(table.limits, kind),
        name=table.joint_name,
        speed=_speed(table),
        effort=table.effort,
        curve=_curve(table.curve),
        steering=_steering(table.steering),
        follows=_follows(table.follows, kind),
    )


def _given(table: schema.Table, *without: str) -> dict[str, Any]:
    return {key: value for key, value in table if value is not None and key not in without}


def _curve(table: Any) -> Curve | None:
    if table is None:
        return None
    with under("curve"):
        curve: Curve = CURVES[table.kind](**_given(table, "kind"))
        return curve


def _steering(table: schema.SteeringTable | None) -> Steering | None:
    if table is None:
        return None
    with under("steering"):
        return Steering(**_given(table))


def _follows(table: Any, kind: str) -> Coupling | None:
    if table is None:
        return None
    with under("follows"):
        made = _given(table, "kind")
        if "offset" in made:
            unit = _unit(kind)
            with under("offset"):
                made["offset"] = coordinate(made["offset"], unit)
        coupling: Coupling = FOLLOWS[table.kind](**made)
        return coupling


def _speed(table: schema.LinkTable) -> float | None:
    if table.speed is None:
        return None
    with under("speed"):
        return coordinate(table.speed, f"{_unit(table.joint)}/s")


def _unit(kind: str) -> str:
    """Of the only coordinate of a joint."""
    if kind not in SINGLE:
        raise InputError(f"a {kind} joint has none; {', '.join(SINGLE)} joints have one")
    return KINDS[kind].units[0]


def _constants(table: schema.LinkTable, convention: str) -> tuple[Pose, Pose]:
    """place and tail of a joint."""
    if table.dh is None:
        with under("place"):
            place = pose(table.place)
        with under("tail"):
            return place, pose(table.tail)
    if {"place", "tail"} & table.model_fields_set:
        raise InputError("dh and place or tail: give one of the two only")
    if table.joint not in ("fixed", "revolute", "prismatic"):
        raise InputError(f"a {table.joint} joint has place and tail, not dh")
    row = np.array([table.dh.theta, table.dh.d, table.dh.a, table.dh.alpha])
    return dh_constants(row, convention, table.joint)


def _limits(given: Sequence[str], kind: str) -> tuple[float, float]:
    with under("limits"):
        unit = _unit(kind)
        low, high = (_within(i, value, unit) for i, value in enumerate(given))
        return low, high


def _within(i: int, value: str, unit: str) -> float:
    with under(i):
        return coordinate(value, unit)
