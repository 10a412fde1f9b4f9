"""Tasks that follow a trajectory as tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.base.errors import InputError
from robsim.describe import option
from robsim.describe.option import Units
from robsim.describe.values import (
    NoDescription,
    Table,
    builtin,
    coordinates,
    length,
    pose,
    quantity,
)
from robsim.geometry.pose import Pose
from robsim.servo import FollowJoints, FollowPath
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid
from robsim.trajectory.pace import UNITS
from robsim.world.scene import Scene

TRAJECTORIES: dict[str, type[Any]] = {
    "quintic": Quintic,
    "trapezoid": Trapezoid,
    "blends": Blends,
}


def joints(value: FollowJoints, truth: Scene) -> Table:
    """Numbers with the units of the joints; NoDescription for a trajectory of somebody's own."""
    table: Table = {}
    try:
        units = [truth.coordinate_units[axis.coordinate] for axis in value.axes(truth)]
    except InputError as error:
        raise NoDescription(str(error)) from None
    if isinstance(value.to, dict):
        both = zip(value.to.items(), units, strict=True)
        table["to"] = {name: quantity(x, unit) for (name, x), unit in both}
    elif value.to is not None:
        table["to"] = _each(value.to, units)
    if value.trajectory is not None:
        table["trajectory"] = _trajectory(value.trajectory, units)
    if value.joints is not None:
        table["joints"] = list(value.joints)
    if value.duration is not None:
        table["duration"] = quantity(value.duration, "s")
    return table | _limits(value, units) | _control(value)


def path(value: FollowPath, units: Units) -> Table:
    """For commanded velocities of these units."""
    table: Table = {}
    if value.to is not None:
        to = value.to if isinstance(value.to, Pose) else Pose.at(*value.to)
        table["to"] = {"position": length(*to.position), **pose(to)}
    if value.path is not None:
        if type(value.path) is Path:
            table["path"] = [_straight(part) for part in value.path.parts]
        else:
            table["path"] = _straight(value.path)
    if value.frame is not None:
        table["frame"] = value.frame
    table |= {"mask": value.mask, **_pace(value), **option.inverse(value.inverse)}
    return table | _control(value) | option.shaping(value, units)


def _control(value: FollowJoints | FollowPath) -> Table:
    gain = {} if value.gain is None else {"gain": value.gain}
    return {**gain, "tolerance": value.tolerance}


def _trajectory(value: Any, units: list[str]) -> Table:
    """A single one, for joints of these units."""
    table: Table = {"kind": builtin(TRAJECTORIES, value)}
    if isinstance(value, Blends):
        table["points"] = [_each(point, units) for point in value.points]
        return table | _limits(value.limits, units) | _limit("corner", value.corner, units, "")
    table |= {name: _each(getattr(value, name), units) for name in ("start", "end")}
    if isinstance(value, Quintic):
        return {**table, "duration": quantity(value.duration, "s")}
    return table | _limits(value.limits, units)


def _straight(value: Any) -> Table:
    if type(value) is not Straight or value.start.matrix.ndim + value.end.matrix.ndim > 4:
        raise NoDescription(f"the path {type(value).__name__} is Python code")
    ends = {name: getattr(value, name) for name in ("start", "end")}
    table = {k: {"position": length(*T.position), **pose(T)} for k, T in ends.items()}
    return {**table, **_pace(value.pace)}


def _pace(value: Any) -> Table:
    told = {name: getattr(value, name) for name in UNITS}
    return {name: quantity(x, UNITS[name]) for name, x in told.items() if x is not None}


def _limits(value: Any, units: list[str]) -> Table:
    table = _limit("speed", value.speed, units, "/s")
    return table | _limit("acceleration", value.acceleration, units, "/s^2")


def _limit(key: str, given: Any, units: list[str], per: str) -> Table:
    if given is None:
        return {}
    if isinstance(given, tuple):
        return {key: _each(given, [f"{unit}{per}" for unit in units])}
    return {key: quantity(given, f"rad{per}")}  # or m: it is for all


def _each(numbers: Sequence[float], units: list[str]) -> list[str]:
    if len(numbers) != len(units):
        raise NoDescription(f"{len(numbers)} numbers for {len(units)} joints")
    return coordinates(numbers, units)
