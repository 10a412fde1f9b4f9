"""Values as the tables of a scenario file, exactly: what `robsim.scenario` reads back.

Lengths are written in metres and angles in radians, with all digits.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robsim.describe.imperfection import spoilt
from robsim.describe.scene import scene
from robsim.describe.task import belief_of, task
from robsim.describe.values import NoDescription as NoDescription
from robsim.describe.values import Table, coordinates, quantity
from robsim.servo import Task
from robsim.world.scene import Scene


def scenario(
    truth: Scene, what: Task, settings: Mapping[str, Any], q0: Any, title: str | None = None
) -> str:
    """The whole scenario as TOML; `q0` is one start, or None where the starts are elsewhere."""
    import tomli_w

    table: Table = {"schema": 1, **({} if title is None else {"title": title})}
    table |= {**scene(truth), "task": task(what, truth)}
    belief = belief_of(what)
    if belief is not None:
        table["belief"] = {"complete": True, **scene(belief)}
    if q0 is not None:
        table["start"] = {"q": coordinates(q0, truth.coordinate_units)}
    table |= {key: part for key, part in spoilt(settings, truth).items() if part}
    return tomli_w.dumps({**table, "run": run(settings)})


def run(value: Mapping[str, Any]) -> Table:
    """dt, duration, seed, hold, record."""
    record = value["record"]
    return {
        "dt": quantity(value["dt"], "s"),
        "duration": quantity(value["duration"], "s"),
        "seed": int(value["seed"]),
        "hold": bool(value["hold"]),
        "record": record if isinstance(record, str) else int(record),
    }
