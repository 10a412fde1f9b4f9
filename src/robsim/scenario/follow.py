"""From the tables of tasks that follow a trajectory to these tasks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.scenario import option
from robsim.scenario import task_schema as schema
from robsim.scenario.build import configuration
from robsim.scenario.place import pose
from robsim.scenario.problems import shown, under
from robsim.scenario.quantity import coordinate, either
from robsim.servo import FollowJoints, FollowPath
from robsim.servo.tasks.named import Axis, axes_called, axes_named
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid
from robsim.world.scene import Scene

Keywords = dict[str, Any]
# of limits and corners: what follows the unit of a coordinate, and what one for all may be
_PER: dict[str, tuple[str, tuple[Any, Any]]] = {
    "speed": ("/s", ("turn rate", "speed")),
    "acceleration": ("/s^2", ("turn acceleration", "acceleration")),
    "corner": ("", ("angle", "length")),
}


def joints(table: schema.FollowJointsTable, scene: Scene) -> FollowJoints:
    """Numbers have the units of the joints; InputError for a joint that does not exist."""
    if isinstance(table.to, dict):
        axes = axes_called(scene, table.to, "to")
    else:
        axes = axes_named(scene, _several(table.joints))
    units, names = _units(scene, axes)
    made = option.said(table, "kind", "to", "trajectory", "speed", "acceleration")
    made |= _limits(table, units)
    if isinstance(table.to, dict):
        made["to"] = {}
        for (name, value), unit in zip(table.to.items(), units, strict=True):
            with under("to", name):
                made["to"][name] = coordinate(value, unit)
    elif table.to is not None:
        with under("to"):
            made["to"] = configuration(table.to, units, names)
    if table.trajectory is not None:
        with under("trajectory"):
            made["trajectory"] = _trajectory(table.trajectory, units, names)
    return FollowJoints(**made)


def path(table: schema.FollowPathTable) -> FollowPath:
    """With what is done to its command."""
    option.check_companions(table)
    made = option.said(table, "kind", "to", "path", "rcond", "damping")
    made |= option.shaping(table) | option.inverse(table)
    if table.to is not None:
        with under("to"):
            made["to"] = pose(table.to)
            if table.mask == "position" and table.to.position is None:
                raise InputError("expected position, which the mask is for")
    if table.path is not None:
        with under("path"):
            made["path"] = _path(table.path)
    return FollowPath(**made)


def _path(table: schema.StraightTable | list[schema.StraightTable]) -> Straight | Path:
    if not isinstance(table, list):
        return _straight(table)
    parts = []
    for i, each in enumerate(table):
        with under(i):
            parts.append(_straight(each))
    return Path(parts)


def _straight(table: schema.StraightTable) -> Straight:
    ends: list[Pose] = []
    for name in ("start", "end"):
        with under(name):
            ends.append(pose(getattr(table, name)))
    return Straight(*ends, **option.said(table, "start", "end"))


def _trajectory(table: Any, units: list[str], names: list[str]) -> Any:
    """Of joints with these units and names."""
    if isinstance(table, schema.BlendsTable):
        points = []
        for i, point in enumerate(table.points):
            with under("points", i):
                points.append(configuration(point, units, names))
        return Blends(np.array(points), **_limits(table, units))
    ends = {}
    for name in ("start", "end"):
        with under(name):
            ends[name] = configuration(getattr(table, name), units, names)
    if isinstance(table, schema.QuinticTable):
        return Quintic(**ends, duration=table.duration)
    return Trapezoid(**ends, **_limits(table, units))


def _limits(table: Any, units: Sequence[str]) -> Keywords:
    """speed, acceleration and corner, of those that there are: one for all, or one for each."""
    made: Keywords = {}
    for key, (per, dimensions) in _PER.items():
        given = getattr(table, key, None)
        if given is None:
            continue
        with under(key):
            if isinstance(given, list):
                each = [f"{unit}{per}" for unit in units]
                made[key] = configuration(given, each, each, "limits").tolist()
            else:
                made[key] = either(given, *dimensions)
            if np.min(made[key]) <= 0:
                raise InputError(f"must be greater than 0, got {shown(given)}")
    return made


def _several(names: Any) -> tuple[str, ...] | None:
    return (names,) if isinstance(names, str) else tuple(names) if names is not None else None


def _units(scene: Scene, axes: list[Axis]) -> tuple[list[str], list[str]]:
    """Units and names of the coordinates of joints."""
    each = scene.coordinate_units, scene.coordinate_names
    units, names = ([told[axis.coordinate] for axis in axes] for told in each)
    return units, names
