"""What is wrong with images and joints as tables; nothing for what is not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from robsim.describe.values import Table, coordinates, quantity
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Occlusion, Sensing


def spoilt(settings: Mapping[str, Any], truth: Scene) -> Table:
    """The tables [sensing] and [actuation]."""
    return {
        "sensing": _sensing(settings["sensing"]),
        "actuation": _actuation(settings["actuation"], truth),
    }


def _sensing(value: Sensing) -> Table:
    if value == Sensing():
        return {}
    table: Table = {
        name: getattr(value, name) for name in ("noise", "quantisation", "outliers", "dropped")
    }
    table["outlier_size"] = value.outlier_size
    table["latency"] = quantity(value.latency, "s")
    if value.period is not None:
        table["period"] = quantity(value.period, "s")
    if value.occlusions:
        table["occlusions"] = [_occlusion(each) for each in value.occlusions]
    return table


def _occlusion(value: Occlusion) -> Table:
    table: Table = {"marks": list(value.marks), "start": quantity(value.start, "s")}
    if value.end != math.inf:
        table["end"] = quantity(value.end, "s")
    names = {name: getattr(value, name) for name in ("target", "camera")}
    return table | {name: given for name, given in names.items() if given is not None}


def _actuation(value: Actuation, truth: Scene) -> Table:
    if value == Actuation():
        return {}
    table: Table = {"lag": quantity(value.lag, "s")}
    rates = truth.velocity_units
    kinds = {
        "velocity": rates,
        "acceleration": [f"{unit}^2" for unit in rates],
        "encoder": truth.coordinate_units,
    }
    for name, units in kinds.items():
        given = getattr(value, name)
        if given is not None:
            table[name] = _each(given, units)
    return table


def _each(given: Any, units: Sequence[str]) -> Any:
    if isinstance(given, tuple):
        return coordinates(given, units)
    return quantity(given, units[0])  # of whatever joint: it is for all
