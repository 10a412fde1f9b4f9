"""The stored instants of a study's runs, in a Zarr folder beside their rows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from robsim.base.arrays import Array
from robsim.base.atomic_files import convert_os_errors, make_draft_path
from robsim.base.errors import InputError
from robsim.run.run_checks import count_periods
from robsim.studies.result_columns import Columns
from robsim.studies.study_plan import Codes, Plan

CHUNK_RUNS = 256  # runs in one chunk of an array
DIMENSIONS = {"q": ("run", "time", "coordinate"), "qd": ("run", "time", "velocity")}
UNITS = {"q": "see coordinate_unit of a run", "qd": "the same, per second", "error_norm": "see s"}


@dataclass(frozen=True)
class TrajectoryStore:
    """A Zarr group, format 3, with arrays over all runs; NaN after the end of each run."""

    path: Path

    def put(self, plan: Plan, first: int, arrays: Columns) -> None:
        """Write the instants of some runs, beginning with run `first`."""
        with convert_os_errors(self.path):
            group = self._group(plan, arrays)
            for name, values in arrays.items():
                group[name][first : first + len(values)] = values

    def open(self, runs: Codes) -> xr.Dataset:
        """Return the instants of the runs with rows, read on demand."""
        import_zarr()
        with convert_os_errors(self.path, "read"):
            data: xr.Dataset = xr.open_zarr(self.path, consolidated=False, chunks=None)
        return data.isel(run=runs).assign_coords(run=runs)

    def _group(self, plan: Plan, arrays: Columns) -> Any:
        """Return the group; the first call creates it atomically, with all its arrays."""
        zarr_module = import_zarr()
        if not self.path.exists():
            draft = make_draft_path(self.path)
            self._make(zarr_module.open_group(draft, mode="w", zarr_format=3), plan, arrays)
            draft.replace(self.path)
        return zarr_module.open_group(self.path, mode="a", zarr_format=3)

    def _make(self, group: Any, plan: Plan, arrays: Columns) -> None:
        """Create empty arrays for all runs, and the times of their instants."""
        for name, values in arrays.items():
            group.create_array(
                name,
                shape=(plan.runs, *values.shape[1:]),
                chunks=(min(CHUNK_RUNS, plan.runs), *values.shape[1:]),
                dtype="float64",
                fill_value=np.nan,
                dimension_names=DIMENSIONS.get(name, ("run", "time")),
                attributes={"units": UNITS[name]},
            )
        time = list_kept_times(plan)
        options = {"dtype": "float64", "dimension_names": ("time",), "attributes": {"units": "s"}}
        group.create_array("time", shape=time.shape, **options)[:] = time


def list_kept_times(plan: Plan) -> Array:
    """Return the times (s) of the stored instants."""
    one, every = plan.experiment, plan.trajectories or 1
    steps = np.arange(0, count_periods(one.dt, one.duration) + 1, every)
    return np.asarray(steps * one.dt, dtype=np.float64)


def count_trajectory_bytes(plan: Plan) -> int:
    """Return the largest size of the instants of one run in bytes."""
    scene = plan.experiment.scene
    return 8 * len(list_kept_times(plan)) * (scene.nq + scene.nv + 1)


def import_zarr() -> Any:
    """Import Zarr; raise InputError if it is not installed."""
    try:
        import zarr
    except ImportError:
        raise InputError("trajectories need Zarr: pip install 'robsim[store]'") from None
    return zarr
