"""Figure of two columns of a study against each other, with a dot for each run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from robsim.base.errors import InputError
from robsim.plot import palette
from robsim.plot.canvas import (
    figure_style,
    get_root_figure,
    prepare_panels,
    replace_frame_by_grid,
    set_axes_title,
)
from robsim.plot.studies import run_dots
from robsim.plot.studies.column_axis import (
    Rows,
    check_column,
    format_column_label,
    read_drawable_column,
)
from robsim.studies import table_columns

if TYPE_CHECKING:
    import pandas as pd

    from robsim.studies.study_result import StudyResult


def study(
    study: StudyResult | pd.DataFrame,
    x: str,
    y: str,
    color: str = "outcome",
    *,
    axes: Axes | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw two columns of a study against each other, with a dot for each run.

    Dots overlap in a random order, so that no outcome hides the others. If more than 100 000 runs
    began, a random sample of 100 000 is drawn, and the title reports it; the legend counts all
    runs. Runs that could not begin are hollow and grey.

    Parameters
    ----------
    study : StudyResult or pandas.DataFrame
        Result of a study, or its table.
    x, y : str
        Columns of numbers; angles are drawn in degrees.
    color : str, default "outcome"
        Column that determines the colours. Outcomes have the same colours in all figures. A column
        of numbers has a scale of colours, and a column of names one colour for each name.
    axes : matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of the axes. Default: the number of runs.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If a column is missing or has no numbers, or if no run has both numbers.

    Examples
    --------
    >>> import pandas as pd
    >>> outcomes = ["CONVERGED", "CONVERGED", "DIVERGED"]
    >>> rows = {"task.gain": [1.0, 2.0, 30.0], "pixel_error": [0.01, 0.01, 900.0]}
    >>> table = pd.DataFrame({**rows, "outcome": outcomes, "began": True})
    >>> figure = study(table, "task.gain", "pixel_error")
    >>> [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    ['converged (2)', 'diverged (1)']
    """
    table = table_columns.get_table(study)
    names = check_column(x, "x", table), check_column(y, "y", table)
    color = check_column(color, "color", table)
    across, up = (read_drawable_column(table, name) for name in names)
    finite = np.isfinite(across) & np.isfinite(up)
    if not finite.any():
        raise InputError(f"no run has both {names[0]} and {names[1]}: there is nothing to draw")
    started = finite & table_columns.read_began(table)
    with figure_style():
        figure, (panel,) = prepare_panels(axes, 1, size, (7.2, 4.4))
        run_dots.draw_hollow_dots(panel, across, up, run_dots.shuffle_rows(finite & ~started))
        unstarted = run_dots.build_unstarted_legend(int((finite & ~started).sum()))
        _draw_study_dots(panel, table, (across, up), color, started, unstarted)
        panel.set(
            xlabel=format_column_label(table, names[0]), ylabel=format_column_label(table, names[1])
        )
        replace_frame_by_grid(panel)
        panel.set_axisbelow(True)
        set_axes_title(panel, run_dots.format_run_total(table, started, finite & ~started), title)
    return figure


def _draw_study_dots(
    axes: Axes,
    table: pd.DataFrame,
    at: run_dots.DotPositions,
    color: str,
    rows: Rows,
    unstarted: list[Line2D],
) -> None:
    """Draw the runs that began in the colours of a column, with a legend or a colour bar."""
    if color == "outcome":
        endings, some = table_columns.read_outcomes(table), run_dots.shuffle_rows(rows)
        run_dots.draw_dots(axes, *at, some, c=run_dots.list_outcome_colors(endings)[some])
        run_dots.show_side_legend(axes, run_dots.build_outcome_legend(endings, rows) + unstarted)
    elif table_columns.is_number_column(table, color):
        values = read_drawable_column(table, color)
        some = run_dots.shuffle_rows(rows & np.isfinite(values))
        points = run_dots.draw_dots(axes, *at, some, c=values[some], cmap=run_dots.COLORS)
        get_root_figure(axes).colorbar(
            points, ax=axes, label=format_column_label(table, color), aspect=30
        )
        if unstarted:
            axes.legend(handles=unstarted, loc="upper left", frameon=False)
    else:
        groups = table_columns.group_column(table, color)
        some = run_dots.shuffle_rows(rows & (groups.which >= 0))
        faces = to_rgba_array([palette.cycle_color(i) for i in range(len(groups.labels))])
        run_dots.draw_dots(axes, *at, some, c=faces[groups.which[some]])
        run_dots.show_side_legend(
            axes,
            run_dots.build_choice_legend(groups, rows) + unstarted,
            format_column_label(table, color),
        )
