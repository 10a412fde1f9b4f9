"""The first difference between a run and its repetition."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.engine.outcome import Outcome
from robsim.files.run_schema import ENDS, VERSIONS

if TYPE_CHECKING:
    import xarray as xr

GIVEN = ("q0", "s_goal", "pixels_goal")  # variables per run that are known at its start


class DifferingVariable(NamedTuple):
    """A variable that differs: its name, its first difference in words, and two counts.

    `values` is the number of differing values, `of` the number of all values.
    """

    name: str
    first: str
    values: int
    of: int


def find_difference(run: xr.Dataset, again: xr.Dataset) -> str:
    """Return a description of the differences between a run and its repetition.

    The description is empty if there is no difference. Only variables and instants that both runs
    have are compared. If the run was stopped, only the part before the stop is compared.
    """
    missing, run, again = _align_instants(run, again)
    names_compared = [name for name in run.variables if name in again.variables]
    differing = [
        each for name in names_compared for each in _compare_variable(run, again, str(name))
    ]
    if not differing:
        return (
            f"{missing} of its instants are missing now; {_explain_difference(run, again)}"
            if missing
            else ""
        )
    count, total = sum(each.values for each in differing), sum(each.of for each in differing)
    names = ", ".join(each.name for each in differing)
    many = f"{count} of {total} values differ, in {names}"
    return f"{differing[0].first}; {many}; {_explain_difference(run, again)}"


def _align_instants(run: xr.Dataset, again: xr.Dataset) -> tuple[int, xr.Dataset, xr.Dataset]:
    """Return the number of missing instants, and both runs at their common instants."""
    if not ("time" in run.dims and "time" in again.dims):
        return 0, run, again
    _, own, others = np.intersect1d(run["time"], again["time"], return_indices=True)
    return run.sizes["time"] - len(own), run.isel(time=own), again.isel(time=others)


def _compare_variable(run: xr.Dataset, again: xr.Dataset, name: str) -> Iterator[DifferingVariable]:
    """Yield the difference of a variable, if there is one."""
    was, now = run[name].variable, again[name].variable
    if was.dims != now.dims or was.shape != now.shape:  # a summary, or one run of a batch
        return
    differ = (was.values != now.values) & ~(_is_undefined(was.values) & _is_undefined(now.values))
    differ = differ & ~_find_unknown_values(run, name)
    if not differ.any():
        return
    first = np.unravel_index(int(np.argmax(differ)), differ.shape)
    place = _format_place(run, name, dict(zip(map(str, was.dims), map(int, first), strict=True)))
    values = f"{now.values[first]!s:.60} now and was {was.values[first]!s:.60}"
    yield DifferingVariable(name, f"{place} is {values}", int(differ.sum()), differ.size)


def _find_unknown_values(run: xr.Dataset, name: str) -> NDArray[np.bool_]:
    """Return a mask of the values that a stopped run lacks, in the shape of the variable."""
    values = run[name].values
    if "outcome" not in run.variables or name in GIVEN or not _is_per_run(run, name):
        return np.zeros(values.shape, bool)
    stopped = np.asarray(run["outcome"].values == Outcome.RUNNING)
    if "run" in run[name].dims:
        stopped = stopped.reshape(-1, *[1] * (values.ndim - 1))
    missing = np.ones(values.shape, bool) if name in ENDS else _is_undefined(values)
    return np.asarray(missing & stopped)


def _is_per_run(run: xr.Dataset, name: str) -> bool:
    """Return whether a variable has values of its own for each run."""
    return name not in run.coords and ("run" in run[name].dims or "run" not in run.dims)


def _is_undefined(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.isnan(values) if values.dtype.kind == "f" else np.zeros(values.shape, bool)


def _format_place(run: xr.Dataset, name: str, index: dict[str, int]) -> str:
    """Return the label of a value, such as "q[elbow] of run 3 at 0.2 s"."""
    labels = {dim: run[dim].values[i] if dim in run.coords else i for dim, i in index.items()}
    of = f" of run {labels.pop('run')}" if "run" in labels else ""
    at = f" at {labels.pop('time')} s" if "time" in labels else ""
    return f"{name}[{','.join(map(str, labels.values()))}]{of}{at}" if labels else name + of + at


def _explain_difference(run: xr.Dataset, again: xr.Dataset) -> str:
    """Return the probable reason: other versions, or a change of the run or its experiment."""
    others = [
        f"{name} {run.attrs.get(name, '?')!s:.40} (now {again.attrs[name]})"
        for name in VERSIONS
        if name in again.attrs and run.attrs.get(name) != again.attrs[name]
    ]
    if others:
        return f"it was made with {', '.join(others)}"
    return "it was changed, or made by another scene, task or setting"
