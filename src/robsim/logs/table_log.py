"""Conversion of tables to runs: CSV and Parquet files with named columns."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError, InputError, format_value, prefix_errors, suggest_names
from robsim.base.si_units import Dimension, get_unit_factor
from robsim.logs.name_map import check_name_map
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Log, Stream, Times
from robsim.run.run_checks import check_instance
from robsim.run.run_from_log import make_run_from_log

if TYPE_CHECKING:
    import pandas as pd

LATEST = 9e9  # seconds: larger times do not fit into 64-bit nanoseconds
DIMENSIONS: dict[str, Dimension] = {
    "rad": "angle",
    "m": "length",
    "rad/s": "turn rate",
    "m/s": "speed",
    "s": "time",
}


class LogColumn(NamedTuple):
    """The group (q, qd, qd_actual, pixels or time) and the unit of a column of a run."""

    group: str
    unit: str


def read_log(
    path: str | os.PathLike[str] | pd.DataFrame | Sequence[Mapping[str, float]],
    experiment: Experiment,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Read a table as a run.

    The columns have the names of `to_table`: time; q[joint]; pixels[mark,column] and
    pixels[mark,row]; optionally the commanded velocities qd[velocity] and the measured velocities
    qd_actual[velocity]. Other columns are ignored. Rows are in the order of time, at any intervals.

    The run has one instant for each period of the experiment, with the joints, pixels and commands
    nearest to it, within half a period. Without joints it has interpolated joints, and without
    pixels or commands the last ones; see the Notes. A row may be empty in all columns of the
    joints, or of all marks of a target: then there is no new measurement. If a single mark is
    empty, it was not seen.

    Parameters
    ----------
    path : path_like, pandas.DataFrame or sequence of mappings
        CSV file, Parquet file, table, or list of rows as returned by `Controller.row`.
    experiment : Experiment
        Experiment with the scene, the task and the period. The table determines the start and the
        duration of the run.
    columns : mapping, optional
        Names {column of a run: column of the table}, if they differ.
    units : mapping, optional
        Units of columns, or of the groups q, qd, qd_actual and time, if they are not SI units, such
        as {"q": "deg"}.

    Returns
    -------
    xarray.Dataset
        Run with the recorded values.

    Raises
    ------
    FileError
        If the file cannot be read, or a column is missing.
    InputError
        If a name or a unit in an argument does not exist.

    Notes
    -----
    The clock of a log jitters and drifts. The run therefore has the variables `log_time`, the time
    of the joints of an instant in seconds since the start, `image_age` and `command_age`, the ages
    of images and commands at this time in seconds, and `interpolated`, whether joints were
    interpolated. The attributes `interpolated_joints`, `held_images` and `held_commands` are the
    numbers of instants without a measurement, a new image or a new command.

    Images that keep step with the joints belong to the instant after them, and commands to the
    instant before them, with a tolerance of a fifth of a period; the mean phase of all images or
    commands decides. If they do not keep step, such as images of 30 Hz in periods of 40 ms, the
    last image or command before the instant is held.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> from robsim.logs import to_table
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> run = experiment.run(duration=0.4)
    >>> to_table(run).to_csv("log.csv", index=False)
    >>> bool((read_log("log.csv", experiment).q == run.q).all())
    True
    """
    valid = check_instance(experiment, Experiment, "experiment")
    known = _list_log_columns(valid)
    name, frame = _open_table(path)
    with prefix_errors(name):
        columns_found, scales = _select_columns(frame, known, columns), _unit_factors(known, units)
        return make_run_from_log(_build_log(name, columns_found, valid, scales), valid)


def _list_log_columns(experiment: Experiment) -> dict[str, LogColumn]:
    """Return the columns of a run that a table may have, by name."""
    scene = experiment.scene
    marks = sum(len(sight.target.marks) for sight in Controller(experiment).sights)
    q = zip(scene.coordinate_names, scene.coordinate_units, strict=True)
    qd = list(zip(scene.velocity_names, scene.velocity_units, strict=True))
    return {
        "time": LogColumn("time", "s"),
        **{f"q[{name}]": LogColumn("q", unit) for name, unit in q},
        **{f"{of}[{name}]": LogColumn(of, unit) for of in ("qd", "qd_actual") for name, unit in qd},
        **{f"pixels[{i},{axis}]": LogColumn("pixels", "px") for i in range(marks) for axis in AXES},
    }


AXES = ("column", "row")


def _open_table(path: Any) -> tuple[str, pd.DataFrame]:  # Any: each type is checked
    """Return the name of a table for error messages, and the table; see `read_log`."""
    import pandas as pd

    if isinstance(path, pd.DataFrame):
        return "table", path
    if isinstance(path, list | tuple):
        return "rows", pd.DataFrame(_check_rows(path))
    with convert_os_errors(path, "read"):
        file = Path(path)
        if not file.is_file():
            raise FileError(f"no file {path}")
        if file.suffix.lower() not in (".csv", ".parquet"):
            raise FileError(f"{path}: expected a .csv or .parquet file")
    try:
        if file.suffix.lower() == ".parquet":
            return str(path), pd.read_parquet(file)
        return str(path), pd.read_csv(file, dtype=str)  # for exact rounding in _parse_column
    except ImportError:
        raise InputError("Parquet needs PyArrow: pip install 'robsim[store]'") from None
    except Exception as error:  # noqa: BLE001  readers raise many kinds of errors
        raise FileError(f"{path} cannot be read as a table: {error!s:.200}") from None


def _check_rows(rows: Sequence[Mapping[str, float]]) -> list[Mapping[str, float]]:
    """Return checked rows; raise FileError without rows, or for a row that is not a mapping."""
    if not rows:
        raise FileError("rows: nothing was recorded")
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise FileError(
                f"rows: expected {{column: number}}, got {format_value(row)} in row {i}"
            )
    return list(rows)


def _select_columns(
    frame: pd.DataFrame, known: Mapping[str, LogColumn], name_map: Mapping[str, str] | None
) -> dict[str, Array]:
    """Return the columns of a table as numbers, by their names in a run."""
    form, no = "{column of a run: column}", "no column {} in a run"
    columns = check_name_map(name_map, "columns", form, known, no, "columns", object)
    for table_name in columns.values():
        if table_name not in frame.columns:
            raise InputError(
                f"no column {format_value(table_name)}; "
                f"{suggest_names(table_name, map(str, frame), 'columns')}"
            )
    if "run" in frame.columns and frame["run"].nunique() > 1:
        raise FileError(f"the table has {frame['run'].nunique()} runs; a log has one")
    table_names = {name: columns.get(name, name) for name in known}
    return {
        name: _parse_column(frame[table_name], table_name)
        for name, table_name in table_names.items()
        if table_name in frame.columns
    }


def _parse_column(column: pd.Series, name: str) -> Array:
    """Return a column as numbers, NaN if empty; raise FileError for other content."""
    try:
        values = np.array(column, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise FileError(f"column {name}: {error!s:.100}") from None
    if np.isinf(values).any():
        raise FileError(
            f"column {name}: {values[np.isinf(values)][0]} in row {_first_row(np.isinf(values))}"
        )
    return values


def _unit_factors(
    known: Mapping[str, LogColumn], unit_map: Mapping[str, str] | None
) -> dict[str, float]:
    """Return the factor to SI units of each column."""
    names = [*known, *dict.fromkeys(each.group for each in known.values())]
    form, no = "{column: unit}", "no column {}"
    units = check_name_map(unit_map, "units", form, names, no, "columns", object)
    scales = {}
    for name, (group, unit) in known.items():
        table_unit = units.get(name, units.get(group))
        if table_unit is not None and unit not in DIMENSIONS:
            raise InputError(f"units: {name} is in {unit if unit != '1' else 'no unit'}")
        with prefix_errors(f"units of {name}"):
            scales[name] = (
                1.0 if table_unit is None else get_unit_factor(table_unit, DIMENSIONS[unit])
            )
    return scales


def _build_log(
    source: str, columns: Mapping[str, Array], experiment: Experiment, scales: Mapping[str, float]
) -> Log:
    """Return the log of the columns of a table."""
    scene = experiment.scene
    values_of = {name: values * scales[name] for name, values in columns.items()}
    times = _parse_times(_stack_columns(values_of, ["time"], "time")[:, 0])
    joints = _column_stream(
        "q", times, values_of, [f"q[{name}]" for name in scene.coordinate_names]
    )
    rates = {
        of: _column_stream(of, times, values_of, [f"{of}[{name}]" for name in scene.velocity_names])
        for of in ("qd", "qd_actual")
        if any(name.startswith(f"{of}[") for name in values_of)
    }
    images, first = {}, 0
    for sight in Controller(experiment).sights:
        count = len(sight.target.marks)
        names = [f"pixels[{i},{axis}]" for i in range(first, first + count) for axis in AXES]
        images[sight.key] = _pixel_stream(
            f"pixels of '{sight.target.name}'", times, values_of, names
        )
        first += count
    return Log(source, joints, images, rates.get("qd"), rates.get("qd_actual"))


def _parse_times(seconds: Array) -> Times:
    """Return times in seconds as nanoseconds; raise FileError for values that are not times."""
    wrong = np.asarray(~(np.abs(seconds) < LATEST))
    if wrong.any():
        row = _first_row(wrong)
        raise FileError(f"column time: {seconds[row]} in row {row} is not a time in seconds")
    return np.asarray(np.round(seconds * NANO).astype(np.int64))


def _column_stream(
    what: str, times: Times, columns: Mapping[str, Array], names: Sequence[str]
) -> Stream:
    """Return the rows (n, width) of some columns, without empty rows."""
    values = _stack_columns(columns, names, what)
    empty = np.isnan(values)
    partly = np.asarray(empty.any(axis=1) & ~empty.all(axis=1))
    if partly.any():
        row = _first_row(partly)
        name = names[int(np.argmax(empty[row]))]
        raise FileError(f"column {name}: empty in row {row}, but other columns of {what} are not")
    filled = ~empty.all(axis=1)
    return Stream(what, times[filled], values[filled])


def _pixel_stream(
    what: str, times: Times, columns: Mapping[str, Array], names: Sequence[str]
) -> Stream:
    """Return the rows (n, N, 2) of pixels, without empty rows; half empty marks are not seen."""
    values = _stack_columns(columns, names, what).reshape(len(times), -1, 2)
    values[np.isnan(values).any(axis=2)] = np.nan
    filled = ~np.isnan(values).all(axis=(1, 2))
    return Stream(what, times[filled], values[filled])


def _stack_columns(columns: Mapping[str, Array], names: Sequence[str], what: str) -> Array:
    """Return columns as one array (n, width); raise FileError if a column is missing."""
    for name in names:
        if name not in columns:
            raise FileError(
                f"no column {name}, which {what} needs; give its name in the table as "
                f"columns={{'{name}': ...}}; {suggest_names(name, columns, 'columns of a run')}"
            )
    return np.stack([columns[name] for name in names], axis=1)


def _first_row(wrong: NDArray[np.bool_]) -> int:
    """Return the index of the first row that is true."""
    return int(np.argmax(wrong))
