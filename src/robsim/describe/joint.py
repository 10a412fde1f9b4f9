"""Joints as the keys of a link's table."""

from __future__ import annotations

from typing import Any

from robsim.describe.values import Table, builtin, coordinates, length, ours, pose, quantity
from robsim.geometry.curves import Arc, Catenary, Curve, Line, Polyline
from robsim.robot.joint import KINDS, Ackermann, Chord, Coupling, Joint, Mimic, Rolling, Steering

CURVES: dict[str, type[Any]] = {
    "line": Line,
    "arc": Arc,
    "polyline": Polyline,
    "catenary": Catenary,
}
FOLLOWS: dict[str, type[Any]] = {
    "mimic": Mimic,
    "chord": Chord,
    "ackermann": Ackermann,
    "rolling": Rolling,
}


def joint(value: Joint) -> Table:
    """All of it; nothing for what is not there."""
    kind, units = ours(value, Joint).kind, KINDS[value.kind].units
    table: Table = {"joint": kind, "joint_name": value.name, "effort": value.effort}
    table |= {"place": pose(value.place), "tail": pose(value.tail)}
    if value.limits:
        table["limits"] = coordinates(value.limits, 2 * units)
    if value.speed is not None:
        table["speed"] = quantity(value.speed, f"{units[0]}/s")
    if value.curve is not None:
        table["curve"] = curve(value.curve)
    if value.steering is not None:
        table["steering"] = steering(value.steering)
    if value.follows is not None:
        table["follows"] = follows(value.follows, units[0])
    return table


def curve(value: Curve) -> Table:
    """A curve by its kind."""
    table: Table = {"kind": builtin(CURVES, value)}
    for key, given in vars(value).items():
        if key == "points":
            table[key] = [length(*point) for point in given]
        elif key in ("start", "end"):
            table[key] = length(*given)
        elif key in ("length", "radius"):
            table[key] = length(given)
        elif key == "angle":
            table[key] = quantity(given, "rad")
    return table


def steering(value: Steering) -> Table:
    """How a car steers."""
    ours(value, Steering)
    return {
        "wheelbase": length(value.wheelbase),
        "limit": quantity(value.limit, "rad"),
        "rate": quantity(value.rate, "rad/s"),
    }


def follows(value: Coupling, unit: str) -> Table:
    """What a coordinate depends on."""
    table: Table = {"kind": builtin(FOLLOWS, value)}
    for key, given in vars(value).items():
        if key == "offset":
            table[key] = quantity(given, unit)
        elif key in ("length", "radius", "at"):
            table[key] = length(given)
        else:
            table[key] = given
    return table
