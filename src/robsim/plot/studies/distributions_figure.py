"""Figure of the measures of a study as empirical distributions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import palette
from robsim.plot.canvas import figure_style, prepare_panels, replace_frame_by_grid
from robsim.plot.fitted_legend import add_fitted_legend
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

    from robsim.studies.study_result import StudyResult

MOST_LINES, IN_A_ROW, MOST_PANELS = 7, 4, 24
LEGEND = 1.6  # width of a legend entry, inches
MOST_TICKS = 4  # most intervals between the ticks of a panel
PLAIN_EXPONENTS = -2, 3  # powers of ten of numbers that are written in full
STEPS = 2000  # points of a line; more are not visible
WIDE = 10.0  # ratio of the largest value to the median; above it the axis is logarithmic


def study_distributions(
    study: StudyResult | pd.DataFrame,
    measures: Sequence[str] | str | None = None,
    *,
    by: str | None = None,
    among: Among = "converged",
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the empirical distributions of measures over the runs of a study, one panel each.

    Each line is the share of the runs with at most the value on the horizontal axis; it passes 50 %
    at the median. The band of half width

        sqrt(ln(40) / (2 n))

    contains the whole true distribution with 95 % confidence (Dvoretzky, Kiefer and Wolfowitz 1956,
    with the constant of Massart 1990). n is the number of runs, and the title of the panel.
    Measures with a long tail have a logarithmic axis.

    Parameters
    ----------
    study : StudyResult or pandas.DataFrame
        Result of a study, or its table.
    measures : str or sequence of str, optional
        Columns of numbers. Default: the measures of the table with differing values.
    by : str, optional
        Column with up to 7 values, such as "task"; each value gets a line.
    among : {"converged", "began"}, default "converged"
        Counted runs: the runs that converged, or all runs that began.
    size : (float, float), optional
        Width and height of the figure in inches.
    title : str, optional
        Title of the figure. Default: the number of counted runs.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InputError
        If a column is missing or has no numbers, or if no runs are counted.

    Examples
    --------
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
    """Add a legend of the lines below all panels, with the number of counted runs of each."""
    counts = np.bincount(lines.which[rows & (lines.which >= 0)], minlength=len(lines.labels))
    handles = [
        Line2D([], [], label=f"{name} ({format_thousands(n)})", **_style_line(i))
        for i, (name, n) in enumerate(zip(lines.labels, counts, strict=True))
    ]
    columns = max(1, int(figure.get_figwidth() / LEGEND))
    placement: dict[str, Any] = {"loc": "outside lower center", "ncols": min(len(handles), columns)}
    names = [str(handle.get_label()) for handle in handles]
    add_fitted_legend(figure, handles, names, **placement)


def _style_line(i: int) -> dict[str, Any]:
    """Return the colour and line style of the i-th line."""
    return {"color": palette.cycle_color(i), "linestyle": palette.LINES[i % len(palette.LINES)]}


def _choose_measures(
    table: pd.DataFrame, rows: Rows, measures: Sequence[str] | str | None
) -> Sequence[str]:
    """Return the measures to draw: `measures`, or all that differ among the counted runs."""
    if measures is not None:
        names = table_columns.check_column_names(measures, "measures")
        if len(names) > MOST_PANELS:
            raise InputError(f"measures: expected up to {MOST_PANELS} columns, got {len(names)}")
        return names
    names = [
        name
        for name in table_columns.list_measures(table)
        if has_spread(read_drawable_column(table, name)[rows])
    ]
    if not names:
        raise InputError("no measure of this study differs between the counted runs")
    return names[:MOST_PANELS]


def _draw_distributions(
    axes: Axes, table: pd.DataFrame, name: str, rows: Rows, lines: table_columns.ColumnGroups
) -> None:
    """Draw the distribution of a measure for each value of `lines`, with its band."""
    values = read_drawable_column(table, name)
    valid = rows & np.isfinite(values) & (lines.which >= 0)
    if not valid.any():
        raise InputError(f"no counted run has a number in column {name!r}")
    for i in range(len(lines.labels)):
        ordered = np.sort(values[valid & (lines.which == i)])
        if ordered.size:
            _draw_step_curve(axes, ordered, i)
    least, most = values[valid].min(), values[valid].max()
    label = format_column_label(table, name)
    if least > 0 and most > WIDE * np.median(values[valid]):  # long tail
        axes.set_xscale("log")
    else:
        label = _set_short_ticks(axes, label)
    axes.set(xlabel=label, ylim=(0, 100))
    axes.set_title(f"n {format_thousands(int(valid.sum()))}", fontsize=8, loc="right")
    replace_frame_by_grid(axes)


def _set_short_ticks(axes: Axes, label: str) -> str:
    """Set few ticks with short numbers; return the label with the power of ten that they lack.

    Matplotlib writes small numbers in full, which overlap, or their power of ten over the label.
    """
    formatter = ScalarFormatter(useOffset=False)
    exponent = math.floor(math.log10(np.abs(axes.get_xlim()).max()))
    if not PLAIN_EXPONENTS[0] <= exponent <= PLAIN_EXPONENTS[1]:
        formatter.set_powerlimits((exponent, exponent))
        words, _, unit = label.partition(" (")
        factor = f"$10^{{{exponent}}}$ {unit.removesuffix(')')}"
        label = f"{words} ({factor.strip()})"
    axes.xaxis.set_major_locator(MaxNLocator(MOST_TICKS, steps=[1, 2, 2.5, 5, 10]))
    axes.xaxis.set_major_formatter(formatter)
    axes.xaxis.get_offset_text().set_visible(False)
    return label


def _draw_step_curve(axes: Axes, ordered: Array, i: int) -> None:
    """Draw the distribution of ordered values with its band, in at most `STEPS` points."""
    n = len(ordered)
    indices = np.unique(np.linspace(0, n - 1, min(n, STEPS)).round().astype(int))
    x = np.concatenate([ordered[:1], ordered[indices]])
    share = np.concatenate([[0.0], (indices + 1) / n])
    band = math.sqrt(math.log(40) / (2 * n))
    look: dict[str, Any] = {"step": "post", "alpha": 0.15, "linewidth": 0}
    low, high = np.clip(share - band, 0, 1), np.clip(share + band, 0, 1)
    axes.fill_between(x, 100 * low, 100 * high, color=palette.cycle_color(i), **look)
    axes.plot(x, 100 * share, drawstyle="steps-post", **_style_line(i))
