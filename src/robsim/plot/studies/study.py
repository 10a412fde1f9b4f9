"""Two columns of a study against each other, a dot for each run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba_array
from matplotlib.figure import Figure

from robsim.base.errors import InputError
from robsim.plot import palette
from robsim.plot.canvas import open_frame, panels_of, set_title, style, whole
from robsim.plot.studies import dots
from robsim.plot.studies.axis import Rows, drawn, given, label
from robsim.studies import reading

if TYPE_CHECKING:
    import pandas as pd


def study(
    study: Any,
    x: str,
    y: str,
    color: str = "outcome",
    *,
    axes: Any = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw two columns of a study against each other, with a dot for each run.

    study       a study, or its table
    x, y        columns of numbers; angles are drawn in degrees
    color       "outcome": a colour for each, the same in all figures; or another column: colours
                of a scale for numbers, a colour for each value of a choice such as "task"

    Runs that could not begin are hollow and grey. Dots lie over each other in a mixed order, so
    that none is hidden for what it is; of more than 100 000 that began as many are drawn, and the
    title says so. The counts in the legend are of all. `axes` is one to draw into, instead of a new
    figure of `size` (width, height) inches.

    InputError: a column that is not there or holds no numbers, or where no run has both.

    >>> import pandas as pd
    >>> outcomes = ["CONVERGED", "CONVERGED", "DIVERGED"]
    >>> rows = {"task.gain": [1.0, 2.0, 30.0], "pixel_error": [0.01, 0.01, 900.0]}
    >>> table = pd.DataFrame({**rows, "outcome": outcomes, "began": True})
    >>> figure = study(table, "task.gain", "pixel_error")
    >>> [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    ['converged (2)', 'diverged (1)']
    """
    table = reading.table_of(study)
    names = given(x, "x", table), given(y, "y", table)
    color = given(color, "color", table)
    across, up = (drawn(table, name) for name in names)
    known = np.isfinite(across) & np.isfinite(up)
    if not known.any():
        raise InputError(f"no run has both {names[0]} and {names[1]}: there is nothing to draw")
    started = known & reading.began(table)
    with style():
        figure, (panel,) = panels_of(axes, 1, size, (7.2, 4.4))
        dots.hollow(panel, across, up, dots.order(known & ~started))
        apart = dots.apart_legend(int((known & ~started).sum()))
        _draw(panel, table, (across, up), color, started, apart)
        panel.set(xlabel=label(table, names[0]), ylabel=label(table, names[1]))
        open_frame(panel)
        panel.set_axisbelow(True)
        set_title(panel, dots.title_of(table, started, known & ~started), title)
    return figure


def _draw(
    axes: Axes, table: pd.DataFrame, at: dots.At, color: str, rows: Rows, apart: list[Any]
) -> None:
    """Draw the runs that began in the colours of a column, with a legend or a scale."""
    if color == "outcome":
        endings, some = reading.outcomes(table), dots.order(rows)
        dots.scatter(axes, *at, some, c=dots.outcome_colors(endings)[some])
        dots.show_legend(axes, dots.outcome_legend(endings, rows) + apart)
    elif reading.is_number(table, color):
        values = drawn(table, color)
        some = dots.order(rows & np.isfinite(values))
        shown = dots.scatter(axes, *at, some, c=values[some], cmap=dots.COLORS)
        whole(axes).colorbar(shown, ax=axes, label=label(table, color), aspect=30)
        if apart:
            axes.legend(handles=apart, loc="upper left", frameon=False)
    else:
        groups = reading.groups_of(table, color)
        some = dots.order(rows & (groups.which >= 0))
        faces = to_rgba_array([palette.nth(i) for i in range(len(groups.labels))])
        dots.scatter(axes, *at, some, c=faces[groups.which[some]])
        dots.show_legend(axes, dots.choice_legend(groups, rows) + apart, label(table, color))
