"""Runs as flat tables: a row for each instant or run, and a column for each number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.base.errors import InputError, check_known, format_value
from robsim.files.lazy_dataset import LazyDataset

if TYPE_CHECKING:
    import pandas as pd

ROWS = {"steps": ("run", "time"), "runs": ("run",)}
GOALS = ("s_goal", "pixels_goal")  # the same in all runs, unless these have goals of their own


class RunDataset(LazyDataset):  # type: ignore[no-untyped-call]  # of xarray's __init_subclass__
    """A Dataset as `simulate` returns it, whose `to_dataframe` is `to_table`.

    That of xarray makes a row for every combination of all dimensions: instants times coordinates
    times features times marks and so on, 77 million rows for the demo. It is still there for who
    names the order of the dimensions. All else is that of a Dataset, made when it is first read.
    """

    __slots__ = ()

    def to_dataframe(self, dim_order: Any = None) -> pd.DataFrame:
        """Return `table(self)`; with a dim_order what `xarray.Dataset.to_dataframe` returns."""
        return to_table(self) if dim_order is None else super().to_dataframe(dim_order)


def to_table(run: xr.Dataset, of: Literal["steps", "runs"] | None = None) -> pd.DataFrame:
    """Return a run or a batch as a flat pandas table.

    of      "steps": a row for each recorded instant of each run, until its end; "runs": a row for
            each run, with its start, outcome and end; None: steps where they were recorded

    The columns are run, time (s), and what changes from row to row, called as in the run with the
    name or number in brackets: q[shoulder], s[0], pixels[3,row], camera_velocity[vx]. The outcome
    is its name, also in each row of steps. What is the same in all rows, such as s_goal, is left
    out. `table(run).attrs["units"]` has the unit of each column; `.to_csv(path, index=False)`
    writes it. InputError: no run, or a summary, of which there are no steps.

    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> list(to_table(run))[:3], len(to_table(run))
    (['run', 'time', 'outcome'], 11)
    >>> to_table(run, of="runs").attrs["units"]["distance_to_goal"]
    'm'
    """
    import pandas as pd

    rows = _get_row_dimensions(run, of)
    shape = [run.sizes.get(dim, 1) for dim in rows]
    columns: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    for variable in _order_variables(run, rows):
        for name, unit, values in _yield_columns(run, variable, rows):
            columns[name], units[name] = np.broadcast_to(values, shape).ravel(), unit
    found = pd.DataFrame(columns)
    if "time" in rows:  # after the end of a run there is nothing but NaN
        measured = [name for name in columns if name not in ("run", "time", "outcome")]
        found = found.dropna(how="all", subset=measured).reset_index(drop=True)
    found.attrs = {"title": run.attrs.get("title", ""), "units": units}
    return found


def _get_row_dimensions(run: Any, of: Any) -> tuple[str, ...]:
    """Return the dimensions that a row stands for."""
    if not isinstance(run, xr.Dataset):
        raise InputError(f"expected a run, a Dataset of simulate, got {format_value(run)}")
    of = ("steps" if "time" in run.dims else "runs") if of is None else of
    check_known(of, ROWS, "no table of {}", "tables")
    if of == "steps" and "time" not in run.dims:
        raise InputError("only the end of this run was recorded: take table(run, of='runs')")
    return ROWS[of]


def _order_variables(run: xr.Dataset, rows: tuple[str, ...]) -> list[xr.DataArray]:
    """Return the names of the variables, with run, time and outcome first."""
    timed = "time" in rows
    names = [name for name in run.data_vars if ("time" in run[name].dims) == timed]
    also = [name for name in run.coords if run[name].dims and set(run[name].dims) <= set(rows)]
    same = [name for name in names if name in GOALS and "run" not in run[name].dims]
    first = [name for name in ("run", *rows[1:], "outcome") if name in run.variables]
    shown = dict.fromkeys([*first, *also, *(name for name in names if name not in same)])
    return [run[name] for name in shown]


def _yield_columns(
    run: xr.Dataset, variable: xr.DataArray, rows: tuple[str, ...]
) -> Iterator[tuple[str, str, NDArray[Any]]]:
    """Return name, unit and values, spread over the rows, of each number of a variable."""
    own = [str(dim) for dim in variable.dims if dim not in rows]
    values = variable.transpose(*(dim for dim in rows if dim in variable.dims), *own).values
    if "flag_meanings" in variable.attrs:
        values = _decode_flags(variable, values)
    where = tuple(slice(None) if dim in variable.dims else None for dim in rows)
    for index in np.ndindex(*(variable.sizes[dim] for dim in own)):
        place = dict(zip(own, index, strict=True))
        if place.get("row") == 3:  # of a pose: 0, 0, 0, 1
            continue
        labels = [str(run[dim].values[i] if dim in run.indexes else i) for dim, i in place.items()]
        name = f"{variable.name}[{','.join(labels)}]" if own else str(variable.name)
        yield name, _get_column_unit(run, variable, place, labels), values[(*where, *index)]


def _decode_flags(variable: xr.DataArray, values: NDArray[Any]) -> NDArray[Any]:
    """Return the names that the values of a variable of flags have."""
    flags = np.atleast_1d(variable.attrs["flag_values"]).tolist()
    names = dict(zip(flags, variable.attrs["flag_meanings"].split(), strict=True))
    return np.array([names[flag] for flag in values.ravel().tolist()], object).reshape(values.shape)


def _get_column_unit(
    run: xr.Dataset, variable: xr.DataArray, place: dict[str, int], labels: list[str]
) -> str:
    """Return the unit of one number of a variable that may hold several units."""
    unit = str(variable.attrs.get("units", "1"))
    if unit.startswith("see "):
        each = run[unit.removeprefix("see ")]
        (dim,) = each.dims
        return str(each.values[place[str(dim)]]) if dim in place else "mixed"
    if "column" in place:  # of a pose: three columns of directions, and the place
        return unit if place["column"] == 3 else "1"
    if unit == "m/s, rad/s" and "twist" in place:
        return unit.split(", ")[place["twist"] // 3]
    return unit
