"""Columns of a study along the axes of a figure: labels, units, values and bins."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from robsim.analysis.measures import MEASURES
from robsim.base.arrays import Array
from robsim.base.errors import InputError, check_known
from robsim.studies import table_columns

if TYPE_CHECKING:
    import pandas as pd

_WORDS = {
    **{name: each.label for name, each in MEASURES.items()},
    **{f"start_{axis}": f"start {axis}" for axis in "xyz"},
    "start_distance": "distance of the start from the goal",
    "start_angle": "angle of the start to the goal",
    "end_time": "time at the end",
    "error_norm": "norm of the error at the end",
}
Rows = NDArray[np.bool_]  # mask of the rows of a table
LARGEST = 1e100  # larger numbers cannot be drawn
FEW = 12  # largest number of different numbers in a column that is treated as a choice


class ColumnBins(NamedTuple):
    """Bins of a column along an axis.

    Attributes
    ----------
    which : array of shape (rows,)
        Bin of each row; -1 for none.
    edges : array of shape (bins + 1,)
        Edges along the axis. The bins of a choice have width 1 and the centres 0, 1, ...
    labels : tuple of str
        Name of each bin of a choice; empty for the bins of a number.
    """

    which: NDArray[np.intp]
    edges: Array
    labels: tuple[str, ...]

    @property
    def bin_count(self) -> int:
        """The number of bins."""
        return len(self.edges) - 1


def format_column_label(table: pd.DataFrame, name: str) -> str:
    """Return the label of a column with its display unit; angles are in degrees."""
    unit = table_columns.get_unit(table, name).replace("rad", "deg").replace("^2", "²")
    return f"{_WORDS.get(name, name)} ({unit})" if unit else _WORDS.get(name, name)


def read_drawable_column(table: pd.DataFrame, name: str) -> Array:
    """Return a column of numbers (rows,) in its display unit.

    Missing and very large values become NaN. Raise InputError unless the column has numbers.
    """
    values = table_columns.read_numbers(table, name)
    values[np.abs(values) > LARGEST] = np.nan
    return np.degrees(values) if table_columns.get_unit(table, name).startswith("rad") else values


def check_column(name: str, argument: str, table: pd.DataFrame) -> str:
    """Return the column name of an argument; raise InputError if there is no such column."""
    names = list(map(str, table.columns))
    check_known(name, names, f"{argument}: no column {{}}", "columns")
    return str(name)


def split_by_choice(
    table: pd.DataFrame, by: str | None, most: int, rows: Rows
) -> table_columns.ColumnGroups:
    """Return the groups of rows with equal values in the column `by`.

    Without `by` all rows are in one group with an empty name. Raise InputError if the column does
    not exist, has more than `most` values, or has no value in the counted rows.
    """
    if by is None:
        return table_columns.ColumnGroups(("",), np.zeros(len(table), np.intp))
    groups = table_columns.group_column(table, check_column(by, "by", table), most)
    _check_has_values(by, groups, rows)
    return groups


def _check_has_values(name: str, groups: table_columns.ColumnGroups, rows: Rows) -> None:
    """Raise InputError unless some of the counted rows have a value."""
    if (groups.which[rows] < 0).all():
        raise InputError(f"column {name!r} has no value in the counted runs")


def bin_column(table: pd.DataFrame, name: str, many: int, rows: Rows, even: bool) -> ColumnBins:
    """Return the bins of a column, computed from the counted rows.

    A choice has one bin for each value. A number has `many` bins: with equal widths if `even`,
    otherwise with equal numbers of rows, so that their estimates are equally certain.
    """
    if not table_columns.is_number_column(table, name) or table[name].nunique() <= FEW:
        groups = table_columns.group_varied_column(table, name)
        _check_has_values(name, groups, rows)
        names = tuple(_format_value_label(table, name, text) for text in groups.labels)
        return ColumnBins(groups.which, np.arange(len(names) + 1.0) - 0.5, names)
    values = read_drawable_column(table, name)
    finite = values[rows & np.isfinite(values)]
    if not finite.size or finite.min() == finite.max():
        raise InputError(f"column {name!r} has fewer than two values in the counted runs")
    low, high = finite.min(), finite.max()
    even_edges = np.linspace(low, high, many + 1)
    edges = even_edges if even else np.unique(np.quantile(finite, np.linspace(0, 1, many + 1)))
    which = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    return ColumnBins(np.where(np.isfinite(values), which, -1), edges, ())


def _format_value_label(table: pd.DataFrame, name: str, text: str) -> str:
    """Return the label of a value: numbers in display units."""
    if table_columns.is_number_column(table, name) and table_columns.get_unit(
        table, name
    ).startswith("rad"):
        return f"{np.degrees(float(text)):.4g}"
    return text


def set_choice_ticks(axes: Axes, along: str, bins: ColumnBins) -> None:
    """Set the ticks of an axis, "x" or "y", to the names of the bins of a choice."""
    if not bins.labels:
        return
    axis = axes.xaxis if along == "x" else axes.yaxis
    axis.set_ticks(range(bins.bin_count), labels=bins.labels)
    axis.set_tick_params(length=0)


def format_thousands(count: int) -> str:
    """Return a count with spaces between the thousands.

    >>> format_thousands(1234567)
    '1 234 567'
    """
    return f"{count:,}".replace(",", " ")


def format_run_counts(table: pd.DataFrame, counted: Rows, verb: str) -> str:
    """Return the number of counted runs and of runs that could not begin, as a title."""
    unstarted = int((~table["began"].to_numpy(bool)).sum())
    rest = f"; {format_thousands(unstarted)} could not begin" if unstarted else ""
    return f"{format_thousands(int(counted.sum()))} runs that {verb}{rest}"
