"""Figure of the share of runs that converged, in cells of two columns of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from robsim.base.arrays import Array, as_integer
from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.plot import palette
from robsim.plot.canvas import figure_style, get_root_figure, new_figure
from robsim.plot.studies.column_axis import (
    ColumnBins,
    bin_column,
    check_column,
    format_column_label,
    format_run_counts,
    set_choice_ticks,
)
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_share
from robsim.studies import table_columns

if TYPE_CHECKING:
    import pandas as pd

    from robsim.studies.study_result import StudyResult

MOST_BINS, MOST_LABELLED = 60, 8  # bins along each axis; bins with numbers in the cells
_SHARES = LinearSegmentedColormap.from_list(  # ends at the blue of runs that converged
    "shares",
    ["#fbe9d9", "#f5d3b3", "#b9cfdd", palette.tint_color(palette.BLUE, 0.35), palette.BLUE],
)


def study_map(
    study: StudyResult | pd.DataFrame,
    x: str,
    y: str,
    *,
    bins: int = 8,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the share of runs that converged (%) against two columns of a study, as a map.

    In a map of up to 8 by 8 cells, the text of a cell is the share, the ends of its 95 % Wilson
    interval and the number of runs. If there are more cells, a second map shows half the width of
    the interval. Cells without a run that began are empty.

    Parameters
    ----------
    study : StudyResult or pandas.DataFrame
        Result of a study, or its table.
    x, y : str
        Columns. A column of numbers is divided into `bins` of equal widths. A column of names, or
        with up to 12 different numbers, has one row or column of cells for each value.
    bins : int, default 8
        Number of bins along each axis, 2 to 60.
    size : (float, float), optional
        Width and height of the figure in inches.
    title : str, optional
        Title of the figure. Default: the number of runs that began.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    InputError
        If a column is missing or has only one value, if both columns are the same, or if no run
        began.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = {"task": ["IBVS", "PBVS"] * 4, "task.gain": [1, 1, 2, 2] * 2}
    >>> outcomes = ["CONVERGED", "OUT_OF_IMAGE"] * 4
    >>> figure = study_map(pd.DataFrame({**rows, "outcome": outcomes, "began": True}), *rows)
    >>> [text.get_text().split()[0] for text in figure.axes[0].texts]
    ['100', '0', '100', '0']
    """
    bins = as_integer(bins, "bins", 2, MOST_BINS + 1)
    table = table_columns.get_table(study)
    names = check_column(x, "x", table), check_column(y, "y", table)
    if x == y:
        raise InputError(f"x and y: expected two columns, got {x!r} twice")
    started = table_columns.read_began(table)
    across, up = (bin_column(table, name, bins, started, even=True) for name in names)
    cells = _count_cells(table, across, up)
    labelled = max(across.bin_count, up.bin_count) <= MOST_LABELLED
    with figure_style():
        figure = new_figure(7.6 if labelled else 10.4, 5.2 if labelled else 4.4, size)
        panels = figure.subplots(1, 1 if labelled else 2, squeeze=False, sharex=True, sharey=True)[
            0
        ]
        value = np.array([[100 * each.value for each in row] for row in cells])
        _paint_cells(panels[0], across, up, value, "converged (%)", cmap=_SHARES, vmax=100.0)
        if labelled:
            _write_cell_numbers(panels[0], across, up, cells)
        else:
            half = np.array([[50 * (e.high - e.low) if e.of else np.nan for e in r] for r in cells])
            text, most = "± half of its 95 % interval (%)", float(np.nanmax(half))
            _paint_cells(panels[1], across, up, half, text, cmap="Greys", vmax=most)
        for axes in panels:
            axes.set(
                xlabel=format_column_label(table, names[0]),
                ylabel=format_column_label(table, names[1]),
            )
            axes.label_outer()
        figure.suptitle(format_run_counts(table, started, "began") if title is None else title)
    return figure


def _count_cells(table: pd.DataFrame, across: ColumnBins, up: ColumnBins) -> list[list[Estimate]]:
    """Return the share of converged runs in each cell [up][across], among the runs that began."""
    rows = table_columns.read_began(table) & (across.which >= 0) & (up.which >= 0)
    place = up.which * across.bin_count + across.which
    converged = rows & (table_columns.read_outcomes(table) == Outcome.CONVERGED)
    many = across.bin_count * up.bin_count
    of, hits = (np.bincount(place[some], minlength=many) for some in (rows, converged))
    shares = [estimate_share(int(hit), int(n)) for hit, n in zip(hits, of, strict=True)]
    return [shares[i : i + across.bin_count] for i in range(0, many, across.bin_count)]


def _paint_cells(
    axes: Axes, across: ColumnBins, up: ColumnBins, values: Array, name: str, **colors: Any
) -> None:
    """Paint cells (up, across) in the colours of a scale that starts at 0; NaN stays empty."""
    look = colors | {"edgecolors": "white", "linewidth": 0.8 if values.size < 400 else 0}
    cells = np.ma.masked_invalid(values)
    mesh = axes.pcolormesh(across.edges, up.edges, cells, vmin=0, **look)
    get_root_figure(axes).colorbar(mesh, ax=axes, label=name, aspect=30)
    set_choice_ticks(axes, "x", across)
    set_choice_ticks(axes, "y", up)
    axes.spines[:].set_visible(False)


def _write_cell_numbers(
    axes: Axes, across: ColumnBins, up: ColumnBins, cells: list[list[Estimate]]
) -> None:
    """Write the share, its interval and the number of runs into each cell that has runs."""
    middle_x, middle_y = ((each.edges[1:] + each.edges[:-1]) / 2 for each in (across, up))
    for y, row in zip(middle_y, cells, strict=True):
        for x, cell in zip(middle_x, row, strict=True):
            if not cell.of:
                continue
            ends = f"{100 * cell.low:.0f}\N{EN DASH}{100 * cell.high:.0f}"
            text = f"{100 * cell.value:.0f} %\n{ends}\nn {cell.of}"
            color = "white" if cell.value > 0.85 else palette.BLACK
            axes.text(x, y, text, ha="center", va="center", fontsize=6.5, color=color)
