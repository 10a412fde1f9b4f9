"""Figure of the share of runs that converged against one column, with Wilson intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_integer
from robsim.engine.outcome import Outcome
from robsim.plot import palette
from robsim.plot.canvas import figure_style, prepare_panels, replace_frame_by_grid
from robsim.plot.fitted_legend import add_fitted_legend
from robsim.plot.studies import column_axis
from robsim.plot.studies.column_axis import ColumnBins, Rows
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_clustered_share
from robsim.studies import table_columns

if TYPE_CHECKING:
    import pandas as pd

    from robsim.studies.study_result import StudyResult

MOST_LINES, MOST_BINS = 7, 100
MARKERS = "osD^v<>"
SPREAD = 0.5  # share of the width of a value over which its markers are spread
ROW = 8.5  # height of a row of counts, points
MOST_COUNTS = 14  # largest number of bins with their own counts; more bins have a range of counts


def study_success(
    study: StudyResult | pd.DataFrame,
    x: str,
    *,
    by: str | None = None,
    bins: int = 10,
    axes: Axes | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the share of runs that converged (%) against a column of a study.

    Bars and bands are 95 % Wilson intervals. The numbers above the axes are the numbers of runs.
    Runs that could not begin are not counted.

    Parameters
    ----------
    study : StudyResult or pandas.DataFrame
        Result of a study, or its table.
    x : str
        Column. A column of names, or with up to 12 different numbers, has a marker for each value.
        Another column of numbers is divided into bins with about equal numbers of runs, and has a
        marker at the mean of each bin.
    by : str, optional
        Column with up to 7 values, such as "task"; each value gets a line.
    bins : int, default 10
        Number of bins of a column of numbers, 2 to 100.
    axes : matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of the axes. Default: the number of runs that began.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If a column is missing, has only one value, or has too many values for a line each.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = {"task": ["IBVS", "PBVS"] * 4, "outcome": ["CONVERGED", "OUT_OF_IMAGE"] * 4}
    >>> figure = study_success(pd.DataFrame({**rows, "began": True}), "task")
    >>> figure.axes[0].get_title(), [text.get_text() for text in figure.axes[0].texts]
    ('8 runs that began', ['n 4', '4'])
    """
    bins = as_integer(bins, "bins", 2, MOST_BINS + 1)
    table = table_columns.get_table(study)
    started = table_columns.read_began(table)
    bins_of_x = column_axis.bin_column(
        table, column_axis.check_column(x, "x", table), bins, started, even=False
    )
    lines = column_axis.split_by_choice(table, by, MOST_LINES, started)
    with figure_style():
        figure, (panel,) = prepare_panels(axes, 1, size, (7.2, 4.2))
        _draw_success_lines(panel, table, x, bins_of_x, lines, started)
        panel.set(
            xlabel=column_axis.format_column_label(table, x), ylabel="converged (%)", ylim=(-3, 103)
        )
        replace_frame_by_grid(panel, "y" if bins_of_x.labels else "both")
        if by is not None:
            add_fitted_legend(
                panel,
                *panel.get_legend_handles_labels(),
                title=column_axis.format_column_label(table, by),
                loc="best",
                alignment="left",
            )
        pad = 6 + ROW * len(lines.labels)  # the counts are below the title
        counted = column_axis.format_run_counts(table, started, "began")
        panel.set_title(counted if title is None else title, pad=pad)
    return figure


def _draw_success_lines(
    axes: Axes,
    table: pd.DataFrame,
    x: str,
    bins_of_x: ColumnBins,
    lines: table_columns.ColumnGroups,
    started: Rows,
) -> None:
    """Draw a line, or markers, for each value of `lines`, with the counts above."""
    converged = table_columns.read_outcomes(table) == Outcome.CONVERGED
    values = np.where(bins_of_x.which >= 0, bins_of_x.which, np.nan)
    values = values if bins_of_x.labels else column_axis.read_drawable_column(table, x)
    many = len(lines.labels)
    for i, name in enumerate(lines.labels):
        rows = started & (lines.which == i) & (bins_of_x.which >= 0)
        place = np.bincount(bins_of_x.which[rows], values[rows], bins_of_x.bin_count)
        of = np.bincount(bins_of_x.which[rows], minlength=bins_of_x.bin_count)
        some = of > 0
        if not some.any():
            continue
        masks = [rows & (bins_of_x.which == k) for k in np.flatnonzero(some)]
        shares = [
            estimate_clustered_share(converged[each], table_columns.read_draws(table, each))
            for each in masks
        ]
        offset = SPREAD * ((i + 0.5) / many - 0.5) if bins_of_x.labels else 0.0
        at = place[some] / of[some] + offset
        _draw_success_shares(axes, at, shares, i, name, of_choice=bool(bins_of_x.labels))
        _write_run_counts(
            axes, at, of[some], many - 1 - i, palette.cycle_color(i) if many > 1 else palette.BLACK
        )
    column_axis.set_choice_ticks(axes, "x", bins_of_x)
    if bins_of_x.labels:
        axes.set_xlim(-0.5, bins_of_x.bin_count - 0.5)


def _draw_success_shares(
    axes: Axes, at: Array, shares: list[Estimate], i: int, name: str, of_choice: bool
) -> None:
    """Draw a marker with a bar for each value of a choice, or a line with a band for a number."""
    value, low, high = 100 * np.array([(each.value, each.low, each.high) for each in shares]).T
    look: dict[str, Any] = {"color": palette.cycle_color(i), "marker": MARKERS[i], "label": name}
    if of_choice:
        ends = (value - low, high - value)
        axes.errorbar(at, value, ends, linestyle="none", capsize=4, markersize=6, **look)
    else:
        axes.fill_between(at, low, high, color=look["color"], alpha=0.18, linewidth=0)
        line = palette.LINES[i % len(palette.LINES)]
        axes.plot(at, value, line, markersize=5, linewidth=1.6, **look)


def _write_run_counts(axes: Axes, at: Array, of: NDArray[np.intp], row: int, color: str) -> None:
    """Write the number of runs of each marker above the axes; for many markers, their range."""
    look: dict[str, Any] = {"color": color, "fontsize": 7, "textcoords": "offset points"}
    up = (0, 3 + ROW * row)
    if len(at) > MOST_COUNTS:
        least, most = column_axis.format_thousands(of.min()), column_axis.format_thousands(of.max())
        text = f"n {least} to {most}"
        axes.annotate(text, (0, 1), up, xycoords="axes fraction", **look)
        return
    for i, (x, n) in enumerate(zip(at, of, strict=True)):
        text = column_axis.format_thousands(n) if i else f"n {column_axis.format_thousands(n)}"
        axes.annotate(text, (x, 1), up, xycoords=axes.get_xaxis_transform(), ha="center", **look)
