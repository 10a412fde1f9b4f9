"""The stored instants of a study's runs, in a Zarr folder beside their rows.

The row of a run has a digest of each of its arrays. The digests are compared when the instants are
read: a missing chunk would otherwise be read as NaN, and a chunk of another study as its numbers.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from robsim.base.arrays import Array
from robsim.base.atomic_files import convert_os_errors, make_draft_path
from robsim.base.errors import FileError, InputError
from robsim.base.file_content import check_regular_file
from robsim.run.run_checks import count_periods
from robsim.studies.result_columns import Columns
from robsim.studies.study_plan import Codes, Plan

Digests = NDArray[np.uint64]
PARTIAL = ".partial"  # suffix of a file that Zarr is writing
CHUNK_RUNS = 256  # runs in one chunk of an array
DIMENSIONS = {
    "q": ("run", "time", "coordinate"),
    "qd": ("run", "time", "velocity"),
    "error_norm": ("run", "time"),
}
UNITS = {"q": "see coordinate_unit of a run", "qd": "the same, per second", "error_norm": "see s"}
INSTANT_NAMES = tuple(DIMENSIONS)


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

    def open(self, plan: Plan, runs: Codes, digests: dict[str, Digests]) -> xr.Dataset:
        """Return the instants of runs, which are read and compared with their digests on demand."""
        time, scene = list_kept_times(plan), plan.experiment.scene
        sizes = {"run": plan.runs, "time": len(time), "coordinate": scene.nq, "velocity": scene.nv}
        variables = {}
        for name, array in self._open_arrays().items():
            shape = tuple(sizes[each] for each in DIMENSIONS[name])
            if array.shape != shape or array.dtype != np.float64:
                raise FileError(f"{self.path / name}: not in the form that RobSim writes")
            stored = _StoredInstants(array, self.path / name, runs, digests[name])
            variables[name] = xr.Variable(DIMENSIONS[name], _wrap(stored), {"units": UNITS[name]})
        times = xr.Variable("time", time, {"units": "s"})
        return xr.Dataset(variables, {"run": runs, "time": times})

    def _open_arrays(self) -> dict[str, Any]:
        """Return the arrays for reading, by name; raise FileError if they cannot be read."""
        zarr_module = import_zarr()
        for path in self.path.rglob("*"):
            if not path.is_dir() and path.suffix != PARTIAL:
                check_regular_file(path, "a file of Zarr")
        try:
            group = zarr_module.open_group(self.path, mode="r", zarr_format=3)
            return {name: group[name] for name in INSTANT_NAMES}
        except Exception as error:  # noqa: BLE001  many kinds of errors for a damaged description
            reason = str(error) or type(error).__name__
            raise FileError(f"{self.path} cannot be read: {reason:.200}") from None

    def _group(self, plan: Plan, arrays: Columns) -> Any:
        """Return the group; the first call creates it atomically, with all its arrays."""
        zarr_module = import_zarr()
        if not self.path.exists():
            draft = make_draft_path(self.path)
            self._make(zarr_module, draft, plan, arrays)
            draft.replace(self.path)
        return zarr_module.open_group(self.path, mode="a", zarr_format=3)

    def _make(self, zarr_module: Any, path: Path, plan: Plan, arrays: Columns) -> None:
        """Create empty arrays for all runs, and the times of their instants."""
        group = zarr_module.open_group(path, mode="w", zarr_format=3)
        for name, values in arrays.items():
            group.create_array(
                name,
                shape=(plan.runs, *values.shape[1:]),
                chunks=(min(CHUNK_RUNS, plan.runs), *values.shape[1:]),
                dtype="float64",
                compressors=(zarr_module.codecs.ZstdCodec(), zarr_module.codecs.Crc32cCodec()),
                fill_value=np.nan,
                dimension_names=DIMENSIONS[name],
                attributes={"units": UNITS[name]},
            )
        time = list_kept_times(plan)
        options = {"dtype": "float64", "dimension_names": ("time",), "attributes": {"units": "s"}}
        group.create_array("time", shape=time.shape, **options)[:] = time


def _wrap(stored: Any) -> Any:
    """Return a stored array that xarray indexes lazily, and copies into memory when it is read."""
    lazy: Any = indexing.LazilyIndexedArray(stored)
    cached: Any = indexing.MemoryCachedArray
    return cached(indexing.CopyOnWriteArray(lazy))


class _StoredInstants(BackendArray):
    """Instants (run, time, ...) in Zarr, compared with the digests of their runs at each reading.

    The runs are read some at a time, and each completely: a chunk holds all instants of its runs.
    """

    def __init__(self, array: Any, path: Path, runs: Codes, digests: Digests):
        self.array, self.path, self.runs, self.digests = array, path, runs, digests
        self.shape, self.dtype = (len(runs), *array.shape[1:]), np.dtype(np.float64)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        outer = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, outer, self._select)

    def _select(self, key: tuple[Any, ...]) -> Array:
        """Return the instants at a position, a slice or positions along each dimension."""
        rows = np.atleast_1d(np.arange(len(self.runs))[key[0]])
        values = np.concatenate([_select_outer(part, key[1:]) for part in self._read(rows)])
        return np.asarray(values[0] if isinstance(key[0], int | np.integer) else values)

    def _read(self, rows: Codes) -> Iterator[Array]:
        """Yield the checked instants of the runs in some rows; raise FileError for damage."""
        for first in range(0, max(len(rows), 1), CHUNK_RUNS):
            some = rows[first : first + CHUNK_RUNS]
            try:
                values = self.array.oindex[self.runs[some]]
            except Exception as error:  # noqa: BLE001  codecs raise many kinds of errors
                reason = str(error).splitlines()[0] if str(error) else type(error).__name__
                raise FileError(f"{self.path} is damaged: {reason:.200}") from None
            wrong = digest_instants(values) != self.digests[some]
            if wrong.any():
                number = self.runs[some][wrong][0]
                raise FileError(
                    f"{self.path}: the instants of run {number} are missing, damaged or of another "
                    f"study; replay({number}) simulates the run again"
                )
            yield values


def _select_outer(values: Array, key: tuple[Any, ...]) -> Array:
    """Return values at a position, a slice or positions along each dimension after the first."""
    for axis in reversed(range(len(key))):
        values = values[(slice(None),) * (axis + 1) + (key[axis],)]
    return values


def digest_instants(values: Array) -> Digests:
    """Return a 64-bit digest of the numbers of each run (run, ...)."""
    rows = (np.ascontiguousarray(each, dtype="<f8").tobytes() for each in values)
    digests = [int.from_bytes(hashlib.sha256(row).digest()[:8], "little") for row in rows]
    return np.array(digests, dtype=np.uint64)


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
