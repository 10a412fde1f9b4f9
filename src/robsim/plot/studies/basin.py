"""From which starts runs converge: the outcome of each by its colour, its time by the shade."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.plot import palette
from robsim.plot.canvas import panels_of, style, whole
from robsim.plot.studies import dots
from robsim.plot.studies.axis import Rows, drawn, given, label, split
from robsim.studies import reading
from robsim.studies.reading import Groups

if TYPE_CHECKING:
    import pandas as pd

MOST_PANELS, IN_A_ROW = 12, 4
_BLUES = LinearSegmentedColormap.from_list(
    "time", [palette.tinted(palette.BLUE, share) for share in (0.72, 0.0, -0.55)]
)


def study_basin(
    study: Any,
    x: str = "start_x",
    y: str = "start_y",
    *,
    by: str | None = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw the starts of a study: from where runs converge, and how fast.

    study       a study, or its table, of which some rows may be taken: a slice of the starts
    x, y        columns of numbers, as a rule two of start_x, start_y, start_z (m)
    by          a choice such as "task": a panel for each of its values

    Runs that converged are blue, the darker the longer they took (s); the others have the colour of
    their outcome, and runs that could not begin are hollow and grey. `size` is (width, height) of
    the figure in inches.

    InputError: a column that is not there or holds no numbers, or nothing that began.

    >>> import pandas as pd
    >>> rows = {"start_x": [0.0, 0.1, 0.2], "start_y": [0.0, 0.0, 0.0], "end_time": [1.0, 2.0, 9.0]}
    >>> outcomes = ["CONVERGED", "CONVERGED", "LOCAL_MINIMUM"]
    >>> figure = study_basin(pd.DataFrame({**rows, "outcome": outcomes, "began": True}))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['start y (m)', 'time to converge (s)']
    """
    table = reading.table_of(study)
    names = given(x, "x", table), given(y, "y", table)
    at = drawn(table, names[0]), drawn(table, names[1])
    known = np.isfinite(at[0]) & np.isfinite(at[1])
    started = reading.began(table) & known
    apart = known & ~started
    if not started.any():
        raise InputError(f"no run that began has both {names[0]} and {names[1]}")
    groups = split(table, by, MOST_PANELS, started)
    with style():
        rows = -(-len(groups.labels) // IN_A_ROW)
        wide = -(-len(groups.labels) // rows)
        inches, many = (2.2 + (4.0 if wide == 1 else 3.2) * wide, 0.9 + 3.3 * rows), rows * wide
        figure, panels = panels_of(None, many, size, inches, wide, sharex=True, sharey=True)
        _fill(panels, table, at, started, apart, groups)
        _frame(panels, table, names, groups.labels)
        figure.suptitle(dots.title_of(table, started, apart) if title is None else title)
    return figure


def _fill(
    panels: list[Axes], table: pd.DataFrame, at: dots.At, started: Rows, apart: Rows, groups: Groups
) -> None:
    """Draw the runs of each value into its panel, with one scale of times and one legend.

    Those that began are `started`, and those that could not `apart`.
    """
    endings, time = reading.outcomes(table), reading.numbers_in(table, "end_time")
    arrived = started & (endings == Outcome.CONVERGED) & np.isfinite(time)
    low, high = (time[arrived].min(), time[arrived].max()) if arrived.any() else (0.0, 1.0)
    faces = dots.outcome_colors(endings)
    faces[arrived] = _BLUES((time[arrived] - low) / max(high - low, 1e-12))
    some, rest = dots.order(started), dots.order(apart)
    for i, axes in enumerate(panels[: len(groups.labels)]):
        dots.hollow(axes, *at, rest[groups.which[rest] == i])
        mine = some[groups.which[some] == i]
        dots.scatter(axes, *at, mine, c=faces[mine])
    handles = dots.outcome_legend(endings, started)
    handles += dots.apart_legend(int(apart.sum()))
    figure = whole(panels[0])
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    if arrived.any():
        scale = dots.scale(_BLUES, low, high)
        figure.colorbar(scale, ax=panels, label="time to converge (s)", aspect=30)


def _frame(
    panels: list[Axes], table: pd.DataFrame, names: tuple[str, str], titles: tuple[str, ...]
) -> None:
    """Set labels, titles and, for two lengths, equal scales; empty panels vanish."""
    for axes in panels[len(titles) :]:
        axes.set_axis_off()
    for axes, text in zip(panels, titles, strict=False):
        axes.set_title(text)
        axes.spines[["top", "right"]].set_visible(False)
        if {reading.unit_of(table, name) for name in names} == {"m"}:
            axes.set_aspect("equal")
        axes.set(xlabel=label(table, names[0]), ylabel=label(table, names[1]))
        axes.label_outer()
