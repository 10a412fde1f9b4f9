"""Columns of a study's table for statistics and figures, with clear errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from robsim.analysis.measures import MEASURES
from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.engine.outcome import Outcome

NEEDED = ("outcome", "began")
START_UNITS = {"start_x": "m", "start_y": "m", "start_z": "m"}
START_GOAL_UNITS = {"start_distance": "m", "start_angle": "rad"}  # from the goal; possible factors
UNITS = {
    **START_UNITS,
    **START_GOAL_UNITS,
    "end_time": "s",
    **{name: each.unit for name, each in MEASURES.items()},
    "error_norm": "",  # features may have mixed units
}
_STANDARD_COLUMNS = {"run", "draw", "start_tries", *NEEDED, *START_UNITS, *START_GOAL_UNITS, *UNITS}
MOST_GROUPS = 30  # most distinct values of a choice

Among = Literal["converged", "began"]


class TabularStudy(Protocol):
    """Protocol of a study: an object with a table of its runs."""

    @property
    def table(self) -> pd.DataFrame:
        """The table with a row for each run."""
        ...


StudyData: TypeAlias = TabularStudy | pd.DataFrame  # a study, or its table


class ColumnGroups(NamedTuple):
    """The distinct values of a column as texts, and the index of each row; -1 for none."""

    labels: tuple[str, ...]
    which: NDArray[np.intp]


def get_table(study: StudyData) -> pd.DataFrame:
    """Return the table of a study, or a table itself, with one row for each run.

    Raises InputError if it is neither, lacks a required column, or has no rows.
    """
    table = getattr(study, "table", study)
    if not isinstance(table, pd.DataFrame):
        raise InputError(f"expected a study or its table, a DataFrame, got {format_value(study)}")
    if not table.columns.is_unique:
        twice = table.columns[table.columns.duplicated()][0]
        raise InputError(f"this table has several columns {twice!r}")
    for name in NEEDED:
        get_column(table, name)
    if not len(table):
        raise InputError("this table has no runs")
    if table["began"].dtype != np.bool_:
        raise InputError("column 'began': expected true or false in every row")
    return table


def get_column(table: pd.DataFrame, name: Any) -> pd.Series[Any]:
    """Return a column by its name; raise InputError with the nearest name if it does not exist."""
    names = list(map(str, table.columns))
    if not is_known_name(name, names):
        raise InputError(
            f"no column {format_value(name)} in this study; {suggest_names(name, names, 'columns')}"
        )
    return table[name]


def is_number_column(table: pd.DataFrame, name: str) -> bool:
    """Return whether a column holds real numbers; truth values do not count."""
    kind = get_column(table, name).dtype
    other = pd.api.types.is_bool_dtype(kind) or pd.api.types.is_complex_dtype(kind)
    return bool(pd.api.types.is_numeric_dtype(kind) and not other)


def read_numbers(table: pd.DataFrame, name: str) -> Array:
    """Return a column of numbers (rows,); missing and infinite values are NaN.

    Raises InputError if the column does not exist or holds texts.
    """
    values = get_column(table, name)
    if not is_number_column(table, name):
        raise InputError(
            f"column {name!r}: expected numbers, but it holds values such as "
            f"{format_value(values.iloc[0])}; group by it instead"
        )
    numbers = values.to_numpy(dtype=np.float64, na_value=np.nan).copy()
    numbers[~np.isfinite(numbers)] = np.nan
    return np.asarray(numbers)


def group_column(table: pd.DataFrame, name: str, most: int = MOST_GROUPS) -> ColumnGroups:
    """Return the distinct values of a column, numbers in ascending order.

    Other values keep the order of their first appearance. Raises InputError if the column does not
    exist, is empty, or has more than `most` values.
    """
    try:
        index, values = pd.factorize(get_column(table, name), sort=is_number_column(table, name))
    except TypeError:
        raise InputError(
            f"column {name!r} holds values that are neither texts nor numbers"
        ) from None
    if not 0 < len(values) <= most:
        raise InputError(
            f"column {name!r} has {len(values)} different values; expected a choice, 1 to {most}"
        )
    return ColumnGroups(_format_labels(values), np.asarray(index, np.intp))


def _format_labels(values: Any) -> tuple[str, ...]:
    """Return values as texts; numbers are abbreviated if the texts stay distinct."""
    short = [f"{v:g}" if isinstance(v, float | np.floating) else str(v) for v in values]
    return tuple(short if len(set(short)) == len(short) else map(str, values))


def group_varied_column(table: pd.DataFrame, name: str) -> ColumnGroups:
    """Return the distinct values of a column; raise InputError if there are fewer than two."""
    groups = group_column(table, name)
    if len(groups.labels) < 2:
        raise InputError(f"column {name!r} has one value only, {groups.labels[0]}")
    return groups


def read_outcomes(table: pd.DataFrame) -> NDArray[np.int64]:
    """Return the outcome number of each row; raise InputError for unknown outcomes."""
    labels, index = group_column(table, "outcome")
    known = Outcome.__members__
    for label in labels:
        if label not in known:
            raise InputError(
                f"column 'outcome': no outcome {label!r}; {suggest_names(label, known, '')}"
            )
    if (index < 0).any():
        raise InputError("column 'outcome' has missing values: expected an outcome in every row")
    return np.array([int(known[label]) for label in labels])[index]


def read_began(table: pd.DataFrame) -> NDArray[np.bool_]:
    """Return which runs began; raise InputError if none did."""
    started: NDArray[np.bool_] = table["began"].to_numpy(dtype=np.bool_)
    if not started.any():
        raise InputError(
            f"none of the {len(table)} runs could begin: their starts do not see the target or "
            "exceed a joint limit"
        )
    return started


def select_counted_runs(table: pd.DataFrame, among: Among) -> NDArray[np.bool_]:
    """Return which runs count: converged runs, or all runs that began; InputError if none do."""
    if not is_known_name(among, ("converged", "began")):
        raise InputError(f"among: expected 'converged' or 'began', got {format_value(among)}")
    started = read_began(table)
    if among == "began":
        return started
    converged: NDArray[np.bool_] = started & (read_outcomes(table) == Outcome.CONVERGED)
    if not converged.any():
        raise InputError(f"none of {started.sum()} runs converged; take among='began' for all")
    return converged


def read_draws(table: pd.DataFrame, rows: NDArray[np.bool_]) -> NDArray[Any]:
    """Return the draws of some rows; each row is its own draw if the table has no draws."""
    draw = table["draw"].to_numpy() if "draw" in table.columns else np.arange(len(table))
    return np.asarray(draw[rows])


def list_measures(table: pd.DataFrame) -> list[str]:
    """Return the numeric columns with results of the runs."""
    names_of_results = [
        name for name in UNITS if name not in START_UNITS and name not in START_GOAL_UNITS
    ]
    return [
        name for name in names_of_results if name in table.columns and is_number_column(table, name)
    ]


def list_factors(table: pd.DataFrame) -> list[str]:
    """Return the columns that may influence the results: varied names, and the start.

    The start is represented by its distance and its angle from the goal. Constant columns are left
    out.
    """
    varied_names = [str(name) for name in table.columns if name not in _STANDARD_COLUMNS]
    candidates = [*varied_names, *(name for name in START_GOAL_UNITS if name in table.columns)]
    return [name for name in candidates if table[name].nunique() > 1]


def get_unit(table: pd.DataFrame, name: str) -> str:
    """Return the unit of a column; "" if it has none or is unknown.

    `table.attrs["units"]`, {column: unit}, holds the units of varied names.
    """
    units = table.attrs.get("units", {})
    unit = str(units.get(name, UNITS.get(name, "")))
    return "" if unit == "1" else unit


def check_column_names(names: Any, subject: str) -> Sequence[str]:
    """Return names of columns as a sequence; raise InputError if there are none."""
    sequence = [names] if isinstance(names, str) else names
    if not isinstance(sequence, list | tuple) or not sequence:
        raise InputError(f"{subject}: expected names of columns, got {format_value(names)}")
    return sequence
