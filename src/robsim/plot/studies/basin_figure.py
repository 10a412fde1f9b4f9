"""Figure of the starts of a study, coloured by outcome and time of convergence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.plot import palette
from robsim.plot.canvas import figure_style, get_root_figure, prepare_panels
from robsim.plot.studies import run_dots, share_bins
from robsim.plot.studies.column_axis import (
    Rows,
    check_column,
    format_column_label,
    read_drawable_column,
    split_by_choice,
)
from robsim.plot.studies.share_bins import ShareBins
from robsim.studies import table_columns
from robsim.studies.table_columns import ColumnGroups

if TYPE_CHECKING:
    import pandas as pd

    from robsim.studies.study_result import StudyResult

MOST_PANELS, IN_A_ROW = 12, 4
_BLUES = LinearSegmentedColormap.from_list(
    "time", [palette.tint_color(palette.BLUE, share) for share in (0.72, 0.0, -0.55)]
)


def study_basin(
    study: StudyResult | pd.DataFrame,
    x: str = "start_x",
    y: str = "start_y",
    *,
    by: str | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the starts of a study: the basin of convergence, and the times of convergence.

    Each dot is the start of a run. Runs that converged are blue; a darker blue is a longer time of
    convergence (s). Other runs have the colour of their outcome, and runs that could not begin are
    hollow and grey. If a panel has more than 2000 runs, squares of the plane have the colour of the
    share of their runs that converged; the runs of squares with fewer than 5 runs are dots.

    Parameters
    ----------
    study : StudyResult or pandas.DataFrame
        Result of a study, or its table. A selection of rows of the table gives a slice of the
        starts.
    x, y : str, default "start_x" and "start_y"
        Columns of numbers, usually two of start_x, start_y, start_z (m).
    by : str, optional
        Column with few values, such as "task"; each value gets a panel.
    size : (float, float), optional
        Width and height of the figure in inches.
    title : str, optional
        Title of the figure. Default: the number of runs.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InputError
        If a column is missing or has no numbers, or if no run with both numbers began.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = {"start_x": [0.0, 0.1, 0.2], "start_y": [0.0, 0.0, 0.0], "end_time": [1.0, 2.0, 9.0]}
    >>> outcomes = ["CONVERGED", "CONVERGED", "LOCAL_MINIMUM"]
    >>> figure = study_basin(pd.DataFrame({**rows, "outcome": outcomes, "began": True}))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['start y (m)', 'time to converge (s)']
    """
    table = table_columns.get_table(study)
    names = check_column(x, "x", table), check_column(y, "y", table)
    at = read_drawable_column(table, names[0]), read_drawable_column(table, names[1])
    finite = np.isfinite(at[0]) & np.isfinite(at[1])
    started = table_columns.read_began(table) & finite
    unstarted = finite & ~started
    if not started.any():
        raise InputError(f"no run that began has both {names[0]} and {names[1]}")
    groups = split_by_choice(table, by, MOST_PANELS, started)
    with figure_style():
        rows = -(-len(groups.labels) // IN_A_ROW)
        wide = -(-len(groups.labels) // rows)
        inches, many = (2.2 + (4.0 if wide == 1 else 3.2) * wide, 0.9 + 3.3 * rows), rows * wide
        figure, panels = prepare_panels(None, many, size, inches, wide, sharex=True, sharey=True)
        _draw_basin_panels(panels, table, at, started, unstarted, groups)
        _set_basin_axes(panels, table, names, groups.labels)
        figure.suptitle(
            run_dots.format_run_total(table, started, unstarted) if title is None else title
        )
    return figure


def _draw_basin_panels(
    panels: list[Axes],
    table: pd.DataFrame,
    at: run_dots.DotPositions,
    started: Rows,
    unstarted: Rows,
    groups: ColumnGroups,
) -> None:
    """Draw the runs of each value into its panel, with one scale of times and one legend.

    `started` selects the runs that began, and `unstarted` the runs that could not begin.
    """
    endings, time = (
        table_columns.read_outcomes(table),
        table_columns.read_numbers(table, "end_time"),
    )
    converged = started & (endings == Outcome.CONVERGED) & np.isfinite(time)
    low, high = (time[converged].min(), time[converged].max()) if converged.any() else (0.0, 1.0)
    faces = run_dots.list_outcome_colors(endings)
    faces[converged] = _BLUES((time[converged] - low) / max(high - low, 1e-12))
    parts = [started & (groups.which == i) for i in range(len(groups.labels))]
    is_dense = max(int(part.sum()) for part in parts) > share_bins.DENSE
    if is_dense:
        bins = [ShareBins.of(at, part, endings == Outcome.CONVERGED) for part in parts]
        for axes, each in zip(panels, bins, strict=False):
            each.draw(axes)
        started = np.any([each.sparse for each in bins], axis=0)
    some, rest = run_dots.shuffle_rows(started), run_dots.shuffle_rows(unstarted)
    for i, axes in enumerate(panels[: len(groups.labels)]):
        run_dots.draw_hollow_dots(axes, *at, rest[groups.which[rest] == i])
        of_panel = some[groups.which[some] == i]
        run_dots.draw_dots(axes, *at, of_panel, c=faces[of_panel])
    handles = run_dots.build_outcome_legend(endings, np.any(parts, axis=0))
    handles += run_dots.build_unstarted_legend(int(unstarted.sum()))
    figure = get_root_figure(panels[0])
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    if is_dense:
        scale = run_dots.build_color_scale(share_bins.SHARES, 0.0, 1.0)
        label = ShareBins.describe(bins)
        figure.colorbar(scale, ax=panels, label=label, aspect=30)
    elif converged.any():
        scale = run_dots.build_color_scale(_BLUES, low, high)
        figure.colorbar(scale, ax=panels, label="time to converge (s)", aspect=30)


def _set_basin_axes(
    panels: list[Axes], table: pd.DataFrame, names: tuple[str, str], titles: tuple[str, ...]
) -> None:
    """Set labels, titles and, for two lengths, equal scales; hide empty panels."""
    for axes in panels[len(titles) :]:
        axes.set_axis_off()
    for axes, text in zip(panels, titles, strict=False):
        axes.set_title(text)
        axes.spines[["top", "right"]].set_visible(False)
        if {table_columns.get_unit(table, name) for name in names} == {"m"}:
            axes.set_aspect("equal")
        axes.set(
            xlabel=format_column_label(table, names[0]), ylabel=format_column_label(table, names[1])
        )
        axes.label_outer()
