"""The coordinates of the variables of a simulation."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr

from robsim.engine.loop import Loop
from robsim.world.scene import Scene

LABELS = 256  # number of lists of names whose indexes are kept


def list_coordinates(loop: Loop, scene: Scene, instants: int) -> dict[str, Any]:
    """Return the coordinates of a simulation by name: (dimensions, values) and attributes.

    Names are lists.
    """
    every = loop.recorder.every or 1
    seconds = {"units": "s", "long_name": "time"}
    keys = [sight.key for sight in loop.controller.sights for _ in sight.target.marks]
    has_pictures = loop.recorder.last.hashes.shape[-1] > 0
    cameras = loop.controller.picture_cameras if has_pictures else []
    constraints = loop.controller.constraint_labels if loop.recorder.last.active.shape[-1] else ()
    return {
        "run": (["run"], loop.runs),
        "time": (["time"], np.arange(instants) * every * loop.dt, seconds),
        "coordinate": (["coordinate"], list(scene.coordinate_names)),
        "coordinate_unit": (["coordinate"], list(scene.coordinate_units)),
        "velocity": (["velocity"], list(scene.velocity_names)),
        "twist": (["twist"], ["vx", "vy", "vz", "wx", "wy", "wz"]),
        "axis": (["axis"], ["column", "row"]),
        "feature_unit": (["feature"], list(loop.controller.units)),
        "mark_camera": (["mark"], np.array([camera for camera, _ in keys], dtype=str)),
        "mark_target": (["mark"], np.array([target for _, target in keys], dtype=str)),
        **({"picture_camera": (["picture"], np.array(cameras, dtype=str))} if cameras else {}),
        **({"constraint": (["constraint"], list(constraints))} if constraints else {}),
    }


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
