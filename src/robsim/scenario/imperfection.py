"""From the tables [sensing] and [actuation] to what is wrong with images and joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.scenario import schema
from robsim.scenario.build import configuration
from robsim.scenario.option import said
from robsim.scenario.problems import under
from robsim.scenario.quantity import DIMENSIONS, coordinate, either
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Occlusion, Sensing


def sensing(table: schema.SensingTable) -> Sensing:
    """Noise, latency and the rest; what is not said is not there."""
    occlusions = []
    for i, each in enumerate(table.occlusions or []):
        with under("occlusions", i):
            occlusions.append(Occlusion(**said(each)))
    return Sensing(**said(table, "occlusions"), occlusions=tuple(occlusions))


def actuation(table: schema.ActuationTable, scene: Scene) -> Actuation:
    """Lag, limits and encoders, each in the units of its joints."""
    rates, names = scene.velocity_units, scene.velocity_names
    coordinates = scene.coordinate_units, scene.coordinate_names
    given = said(table)
    for key, units, owners in (
        ("velocity", rates, names),
        ("acceleration", [f"{unit}^2" for unit in rates], names),
        ("encoder", *coordinates),
    ):
        if key in given:
            with under(key):
                given[key] = _each(given[key], units, owners)
    return Actuation(**given)


def _each(given: Any, units: Sequence[str], owners: Sequence[str]) -> Any:
    """One number for each joint, or one for all: in their unit, or in any of theirs."""
    if isinstance(given, list):
        return configuration(given, units, owners, "numbers")
    kinds = [unit for unit in dict.fromkeys(units) if unit != "1"]
    if len(kinds) == 1:
        return coordinate(given, kinds[0])
    return either(given, *(DIMENSIONS[kind] for kind in kinds))
