"""The coordinates of the variables of a simulation."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.engine.loop import Loop
from robsim.world.scene import Scene

LABELS = 256  # number of lists of names whose indexes are kept


def list_coordinates(loop: Loop, scene: Scene) -> dict[str, tuple[Any, ...]]:
    """Return the coordinates of a simulation by name: (dimensions, function) and attributes.

    The function returns the values; names are lists.
    """
    every = loop.recorder.every or 1
    seconds = {"units": "s", "long_name": "time"}
    controller, last = loop.controller, loop.recorder.last
    pictured = {
        "picture_camera": (["picture"], lambda: np.array(controller.picture_cameras, dtype=str))
    }
    constrained = {"constraint": (["constraint"], lambda: list(controller.constraint_labels))}
    return {
        "run": (["run"], lambda: loop.runs),
        "time": (["time"], lambda: np.arange(loop.recorder.instants) * every * loop.dt, seconds),
        "coordinate": (["coordinate"], lambda: list(scene.coordinate_names)),
        "coordinate_unit": (["coordinate"], lambda: list(scene.coordinate_units)),
        "velocity": (["velocity"], lambda: list(scene.velocity_names)),
        "twist": (["twist"], lambda: ["vx", "vy", "vz", "wx", "wy", "wz"]),
        "axis": (["axis"], lambda: ["column", "row"]),
        "feature_unit": (["feature"], lambda: list(controller.units)),
        "mark_camera": (["mark"], lambda: _list_mark_names(loop, 0)),
        "mark_target": (["mark"], lambda: _list_mark_names(loop, 1)),
        **(pictured if last.hashes.shape[-1] else {}),
        **(constrained if last.active.shape[-1] else {}),
    }


def _list_mark_names(loop: Loop, part: int) -> NDArray[np.str_]:
    """Return the camera (part 0) or the target (part 1) of each image of a mark."""
    sights = loop.controller.sights
    return np.array([sight.key[part] for sight in sights for _ in sight.target.marks], dtype=str)


def make_index(name: str, values: Any, *attributes: Any) -> tuple[xr.Index, xr.Variable]:
    """Return the index of a dimension and its coordinate; lists of names share their index."""
    if isinstance(values, list):
        index, labels = _index_labels(name, tuple(values))
        return index, labels.copy(deep=False)  # attributes can be set
    both = xr.Coordinates({name: ((name,), values, *attributes)})
    return both.xindexes[name], both.variables[name]


@lru_cache(LABELS)
def _index_labels(name: str, labels: tuple[str, ...]) -> tuple[xr.Index, xr.Variable]:
    """Return the index of a dimension with names, which all runs with these names share."""
    both = xr.Coordinates({name: ((name,), list(labels))})
    return both.xindexes[name], both.variables[name]
