"""Runs as flat tables: a row for each instant or run, and a column for each number."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.base.errors import InputError, check_known, format_value
from robsim.files.lazy_dataset import LazyDataset

if TYPE_CHECKING:
    import pandas as pd

ROWS = {"steps": ("run", "time"), "runs": ("run",)}
GOALS = ("s_goal", "pixels_goal")  # often equal in all runs, and then without dimension "run"


class RunDataset(LazyDataset):  # type: ignore[no-untyped-call]  # of xarray's __init_subclass__
    """The Dataset of a run, with a flat `to_dataframe`.

    The method of xarray makes a row for every combination of all dimensions (instants times
    coordinates times features times marks ...), 77 million rows for the demo. It is called if
    `dim_order` is passed.
    """

    __slots__ = ()

    def to_dataframe(self, dim_order: Sequence[Hashable] | None = None) -> pd.DataFrame:
        """Return `to_table(self)`; with `dim_order`, call `xarray.Dataset.to_dataframe`."""
        return to_table(self) if dim_order is None else super().to_dataframe(dim_order)


def to_table(run: xr.Dataset, of: Literal["steps", "runs"] | None = None) -> pd.DataFrame:
    """Return a run or a batch as a flat pandas DataFrame.

    Columns are run, time (s), and all variables that differ between rows. Elements of arrays have
    their name or number in brackets: q[shoulder], s[0], pixels[3,row], camera_velocity[vx].
    Outcomes are given by name. Variables that are equal in all rows, such as s_goal, are left out.

    Parameters
    ----------
    run : xarray.Dataset
        Run of `simulate`, `Experiment.run` or `open_run`.
    of : {"steps", "runs"}, optional
        Rows: "steps" has a row for each recorded instant of each run until its end; "runs" has a
        row for each run, with its start, outcome and end. Default: "steps" if steps were recorded.

    Returns
    -------
    pandas.DataFrame
        The table. `attrs["units"]` has the unit of each column.

    Raises
    ------
    InputError
        If `run` is not a run, or if steps were not recorded.

    Examples
    --------
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
    frame = pd.DataFrame(columns)
    if "time" in rows:  # after the end of a run all values are NaN
        measured = [name for name in columns if name not in ("run", "time", "outcome")]
        frame = frame.dropna(how="all", subset=measured).reset_index(drop=True)
    frame.attrs = {"title": run.attrs.get("title", ""), "units": units}
    return frame


def _get_row_dimensions(run: object, of: Any) -> tuple[str, ...]:
    """Return the dimensions of the rows."""
    if not isinstance(run, xr.Dataset):
        raise InputError(f"expected a run, a Dataset of simulate, got {format_value(run)}")
    of = ("steps" if "time" in run.dims else "runs") if of is None else of
    check_known(of, ROWS, "no table of {}", "tables")
    if of == "steps" and "time" not in run.dims:
        raise InputError("only the end of this run was recorded: take to_table(run, of='runs')")
    return ROWS[of]


def _order_variables(run: xr.Dataset, rows: tuple[str, ...]) -> list[xr.DataArray]:
    """Return the variables in the order of the columns, with run, time and outcome first."""
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
    """Yield name, unit and values of each number of a variable, with the axes of the rows."""
    own = [str(dim) for dim in variable.dims if dim not in rows]
    values = variable.transpose(*(dim for dim in rows if dim in variable.dims), *own).values
    if "flag_meanings" in variable.attrs:
        values = _decode_flags(variable, values)
    where = tuple(slice(None) if dim in variable.dims else None for dim in rows)
    for index in np.ndindex(*(variable.sizes[dim] for dim in own)):
        place = dict(zip(own, index, strict=True))
        if place.get("row") == 3:  # the last row of a pose is 0, 0, 0, 1
            continue
        labels = [str(run[dim].values[i] if dim in run.indexes else i) for dim, i in place.items()]
        name = f"{variable.name}[{','.join(labels)}]" if own else str(variable.name)
        yield name, _get_column_unit(run, variable, place, labels), values[(*where, *index)]


def _decode_flags(variable: xr.DataArray, values: NDArray[Any]) -> NDArray[Any]:
    """Return the names of the flag values of a variable."""
    flags = np.atleast_1d(variable.attrs["flag_values"]).tolist()
    names = dict(zip(flags, variable.attrs["flag_meanings"].split(), strict=True))
    return np.array([names[flag] for flag in values.ravel().tolist()], object).reshape(values.shape)


def _get_column_unit(
    run: xr.Dataset, variable: xr.DataArray, place: dict[str, int], labels: list[str]
) -> str:
    """Return the unit of one number of a variable with possibly mixed units."""
    unit = str(variable.attrs.get("units", "1"))
    if unit.startswith("see "):
        each = run[unit.removeprefix("see ")]
        (dim,) = each.dims
        return str(each.values[place[str(dim)]]) if dim in place else "mixed"
    if "column" in place:  # a pose has three columns of directions, and the position
        return unit if place["column"] == 3 else "1"
    if unit == "m/s, rad/s" and "twist" in place:
        return unit.split(", ")[place["twist"] // 3]
    return unit
