"""From the tables [sensing] and [actuation] to what is wrong with images and joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from robsim.actuation import Actuation
from robsim.arrays import Array
from robsim.scenario import schema
from robsim.scenario.build import configuration
from robsim.scenario.option import said
from robsim.scenario.problems import under
from robsim.scene import Scene
from robsim.sensing import Occlusion, Sensing


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
    given = said(table) | {
        **_each(table, "velocity", rates, names),
        **_each(table, "acceleration", [f"{unit}^2" for unit in rates], names),
        **_each(table, "encoder", scene.coordinate_units, scene.coordinate_names),
    }
    return Actuation(**given)


def _each(
    table: schema.ActuationTable, key: str, units: Sequence[str], names: Sequence[str]
) -> dict[str, Array]:
    given: Any = getattr(table, key)
    if not isinstance(given, list):
        return {}
    with under(key):
        return {key: configuration(given, units, names, "numbers")}
