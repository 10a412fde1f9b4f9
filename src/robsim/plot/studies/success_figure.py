"""The share of the runs that converged against one column, with the intervals of Wilson."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from robsim.base.arrays import as_integer as whole_number
from robsim.engine.outcome import Outcome
from robsim.plot import palette
from robsim.plot.canvas import figure_style, prepare_panels, replace_frame_by_grid
from robsim.plot.studies import column_axis
from robsim.plot.studies.column_axis import ColumnBins, Rows
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_clustered_share
from robsim.studies import table_columns

if TYPE_CHECKING:
    import pandas as pd

MOST_LINES, MOST_BINS = 7, 100
MARKERS = "osD^v<>"
SPREAD = 0.5  # of the place of a value, over which the lines are set beside each other
ROW = 8.5  # height in points of a row of counts
TOLD = 14  # bins up to which the counts are written above each


def study_success(
    study: Any,
    x: str,
    *,
    by: str | None = None,
    bins: int = 10,
    axes: Any = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw which share of the runs converged (%) against a column of a study.

    study       a study, or its table
    x           a choice, or a number with up to 12 values: a mark for each; another number: bins of
                about as many runs each, with the mark at their mean
    by          a choice such as "task": a line for each of its values, up to 7
    bins        how many bins a number is cut into, 2 to 100

    Bars, and bands, are the intervals of Wilson at 95 %, and the numbers above say of how many runs
    each is. Runs that could not begin count nothing. `axes` is one to draw into, instead of a new
    figure of `size` (width, height) inches.

    InputError: a column that is not there, has one value only, or too many for a line each.

    >>> import pandas as pd
    >>> rows = {"task": ["IBVS", "PBVS"] * 4, "outcome": ["CONVERGED", "OUT_OF_IMAGE"] * 4}
    >>> figure = study_success(pd.DataFrame({**rows, "began": True}), "task")
    >>> figure.axes[0].get_title(), [text.get_text() for text in figure.axes[0].texts]
    ('8 runs that began', ['n 4', '4'])
    """
    bins = whole_number(bins, "bins", 2, MOST_BINS + 1)
    table = table_columns.get_table(study)
    started = table_columns.read_began(table)
    found = column_axis.bin_column(
        table, column_axis.check_column(x, "x", table), bins, started, even=False
    )
    lines = column_axis.split_by_choice(table, by, MOST_LINES, started)
    with figure_style():
        figure, (panel,) = prepare_panels(axes, 1, size, (7.2, 4.2))
        _draw_success_lines(panel, table, x, found, lines, started)
        panel.set(
            xlabel=column_axis.format_column_label(table, x), ylabel="converged (%)", ylim=(-3, 103)
        )
        replace_frame_by_grid(panel, "y" if found.labels else "both")
        if by is not None:
            panel.legend(
                title=column_axis.format_column_label(table, by),
                frameon=False,
                loc="best",
                alignment="left",
            )
        pad = 6 + ROW * len(lines.labels)  # the counts are below it
        counted = column_axis.format_run_counts(table, started, "began")
        panel.set_title(counted if title is None else title, pad=pad)
    return figure


def _draw_success_lines(
    axes: Axes,
    table: pd.DataFrame,
    x: str,
    found: ColumnBins,
    lines: table_columns.ColumnGroups,
    started: Rows,
) -> None:
    """Draw a line, or marks, for each value of `lines`, with the counts above."""
    arrived = table_columns.read_outcomes(table) == Outcome.CONVERGED
    values = np.where(found.which >= 0, found.which, np.nan)
    values = values if found.labels else column_axis.read_drawable_column(table, x)
    many = len(lines.labels)
    for i, name in enumerate(lines.labels):
        rows = started & (lines.which == i) & (found.which >= 0)
        place = np.bincount(found.which[rows], values[rows], found.many)
        of = np.bincount(found.which[rows], minlength=found.many)
        some = of > 0
        if not some.any():
            continue
        there = [rows & (found.which == k) for k in np.flatnonzero(some)]
        shares = [
            estimate_clustered_share(arrived[each], table_columns.read_draws(table, each))
            for each in there
        ]
        beside = SPREAD * ((i + 0.5) / many - 0.5) if found.labels else 0.0
        at = place[some] / of[some] + beside
        _draw_success_shares(axes, at, shares, i, name, apart=bool(found.labels))
        _write_run_counts(
            axes, at, of[some], many - 1 - i, palette.cycle_color(i) if many > 1 else palette.BLACK
        )
    column_axis.set_choice_ticks(axes, "x", found)
    if found.labels:
        axes.set_xlim(-0.5, found.many - 0.5)


def _draw_success_shares(
    axes: Axes, at: NDArray[Any], shares: list[Estimate], i: int, name: str, apart: bool
) -> None:
    """Draw a mark with a bar for each value of a choice; of a number a line with a band."""
    value, low, high = 100 * np.array([(each.value, each.low, each.high) for each in shares]).T
    look: dict[str, Any] = {"color": palette.cycle_color(i), "marker": MARKERS[i], "label": name}
    if apart:
        ends = (value - low, high - value)
        axes.errorbar(at, value, ends, linestyle="none", capsize=4, markersize=6, **look)
    else:
        axes.fill_between(at, low, high, color=look["color"], alpha=0.18, linewidth=0)
        line = palette.LINES[i % len(palette.LINES)]
        axes.plot(at, value, line, markersize=5, linewidth=1.6, **look)


def _write_run_counts(axes: Axes, at: NDArray[Any], of: NDArray[Any], row: int, color: str) -> None:
    """Write of how many runs each mark is, in a row above the axes; of many, the least and most."""
    look: dict[str, Any] = {"color": color, "fontsize": 7, "textcoords": "offset points"}
    up = (0, 3 + ROW * row)
    if len(at) > TOLD:
        text = f"n {column_axis.format_thousands(of.min())} to {column_axis.format_thousands(of.max())}"
        axes.annotate(text, (0, 1), up, xycoords="axes fraction", **look)
        return
    for i, (x, n) in enumerate(zip(at, of, strict=True)):
        text = column_axis.format_thousands(n) if i else f"n {column_axis.format_thousands(n)}"
        axes.annotate(text, (x, 1), up, xycoords=axes.get_xaxis_transform(), ha="center", **look)
