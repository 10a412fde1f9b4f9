"""The measures of a study as empirical distributions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import palette
from robsim.plot.canvas import figure_style, prepare_panels, replace_frame_by_grid
from robsim.plot.run_data import has_spread
from robsim.plot.studies.column_axis import (
    Rows,
    format_column_label,
    format_run_counts,
    format_thousands,
    read_drawable_column,
    split_by_choice,
)
from robsim.studies import table_columns
from robsim.studies.table_columns import Among

if TYPE_CHECKING:
    import pandas as pd

MOST_LINES, IN_A_ROW, MOST_PANELS = 7, 4, 24
LEGEND = 1.6  # inches of an entry
STEPS = 2000  # points of a line: more are not seen
WIDE = 10.0  # ratio of the largest value to the median above which an axis is logarithmic


def study_distributions(
    study: Any,
    measures: Sequence[str] | str | None = None,
    *,
    by: str | None = None,
    among: Among = "converged",
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw the distributions of measures over the runs of a study, a panel for each.

    study       a study, or its table
    measures    columns of numbers; None: the measures that the table has and that differ
    by          a choice such as "task": a line for each of its values, up to 7
    among       the runs that count: those that "converged", or all that "began"

    A line rises at each run by its share: where it is at 50 %, there is the median. The band,
    sqrt(ln(40) / 2 n) to either side, holds the true distribution as a whole at 95 % (Dvoretzky,
    Kiefer and Wolfowitz 1956, with the constant of Massart 1990). Measures with a long tail
    have a logarithmic axis. The titles say of how many runs each is. `size` is (width, height) of
    the figure in inches.

    InputError: a column that is not there or holds no numbers, or no run that counts.

    >>> import pandas as pd
    >>> rows = {"end_time": [1.0, 2.0, 3.0], "path_length": [1.0, 1.5, float("nan")]}
    >>> table = pd.DataFrame({**rows, "outcome": "CONVERGED", "began": True})
    >>> [axes.get_title("right") for axes in study_distributions(table).axes]
    ['n 3', 'n 2']
    """
    table = table_columns.get_table(study)
    rows = table_columns.select_counted_runs(table, among)
    names = _choose_measures(table, rows, measures)
    lines = split_by_choice(table, by, MOST_LINES, rows)
    with figure_style():
        down = -(-len(names) // IN_A_ROW)
        wide = -(-len(names) // down)
        inches = max(4.8, 3.0 * wide), 0.9 + 2.5 * down
        figure, panels = prepare_panels(None, down * wide, size, inches, wide, sharey=True)
        for axes, name in zip(panels, names, strict=False):
            _draw_distributions(axes, table, name, rows, lines)
        for axes in panels[len(names) :]:
            axes.set_axis_off()
        for axes in panels[::wide]:
            axes.set_ylabel("share of the runs (%)")
        if by is not None:
            _draw_distribution_legend(figure, lines, rows)
        figure.suptitle(format_run_counts(table, rows, among) if title is None else title)
    return figure


def _draw_distribution_legend(
    figure: Figure, lines: table_columns.ColumnGroups, rows: Rows
) -> None:
    """Show which line is which value, and how many runs of it count, below all panels."""
    counts = np.bincount(lines.which[rows & (lines.which >= 0)], minlength=len(lines.labels))
    handles = [
        Line2D([], [], label=f"{name} ({format_thousands(n)})", **_style_line(i))
        for i, (name, n) in enumerate(zip(lines.labels, counts, strict=True))
    ]
    beside = max(1, int(figure.get_figwidth() / LEGEND))
    where: dict[str, Any] = {"loc": "outside lower center", "ncols": min(len(handles), beside)}
    figure.legend(handles=handles, frameon=False, **where)


def _style_line(i: int) -> dict[str, Any]:
    return {"color": palette.cycle_color(i), "linestyle": palette.LINES[i % len(palette.LINES)]}


def _choose_measures(table: pd.DataFrame, rows: Rows, measures: Any) -> Sequence[str]:
    """Return the measures to draw: those given, or all that differ among the runs that count."""
    if measures is not None:
        names = table_columns.check_column_names(measures, "measures")
        if len(names) > MOST_PANELS:
            raise InputError(f"measures: expected up to {MOST_PANELS} columns, got {len(names)}")
        return names
    found = [
        name
        for name in table_columns.list_measures(table)
        if has_spread(read_drawable_column(table, name)[rows])
    ]
    if not found:
        raise InputError("no measure of this study differs between the runs that count")
    return found[:MOST_PANELS]


def _draw_distributions(
    axes: Axes, table: pd.DataFrame, name: str, rows: Rows, lines: table_columns.ColumnGroups
) -> None:
    """Draw the distribution of a measure for each value of `lines`, with its band."""
    values = read_drawable_column(table, name)
    known = rows & np.isfinite(values) & (lines.which >= 0)
    if not known.any():
        raise InputError(f"no run that counts has a number in column {name!r}")
    for i in range(len(lines.labels)):
        mine = np.sort(values[known & (lines.which == i)])
        if mine.size:
            _draw_step_curve(axes, mine, i)
    least, most = values[known].min(), values[known].max()
    if least > 0 and most > WIDE * np.median(values[known]):  # too long a tail for another axis
        axes.set_xscale("log")
    axes.set(xlabel=format_column_label(table, name), ylim=(0, 100))
    axes.set_title(f"n {format_thousands(int(known.sum()))}", fontsize=8, loc="right")
    replace_frame_by_grid(axes)


def _draw_step_curve(axes: Axes, ordered: Array, i: int) -> None:
    """Draw the distribution of ordered values; of very many, as many as can be seen."""
    n = len(ordered)
    shown = np.unique(np.linspace(0, n - 1, min(n, STEPS)).round().astype(int))
    x = np.concatenate([ordered[:1], ordered[shown]])
    share = np.concatenate([[0.0], (shown + 1) / n])
    band = math.sqrt(math.log(40) / (2 * n))
    look: dict[str, Any] = {"step": "post", "alpha": 0.15, "linewidth": 0}
    low, high = np.clip(share - band, 0, 1), np.clip(share + band, 0, 1)
    axes.fill_between(x, 100 * low, 100 * high, color=palette.cycle_color(i), **look)
    axes.plot(x, 100 * share, drawstyle="steps-post", **_style_line(i))
