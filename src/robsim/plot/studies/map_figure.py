"""Two columns of a study cut into cells, with the share that converged as the colour of each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from robsim.base.arrays import Array
from robsim.base.arrays import as_integer as whole_number
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

MOST_BINS, TOLD = 60, 8  # along each axis; up to how many the numbers are written into the cells
_SHARES = LinearSegmentedColormap.from_list(  # to the blue of runs that converged
    "shares",
    ["#fbe9d9", "#f5d3b3", "#b9cfdd", palette.tint_color(palette.BLUE, 0.35), palette.BLUE],
)


def study_map(
    study: Any, x: str, y: str, *, bins: int = 8, size: Any = None, title: str | None = None
) -> Figure:
    """Draw which share of the runs converged (%) against two columns of a study, as a map.

    study       a study, or its table
    x, y        numbers, which are cut into `bins` of equal widths; or choices, and numbers with up
                to 12 values, of which each has a row or column of its own
    bins        2 to 60

    Up to 8 by 8 cells have their share, the ends of its interval of Wilson at 95 % and the number
    of their runs written into them; of more a second map shows half the width of the interval.
    Cells without any run that began are empty. `size` is (width, height) of the figure in inches.

    InputError: a column that is not there or has one value only, the same twice, nothing began.

    >>> import pandas as pd
    >>> rows = {"task": ["IBVS", "PBVS"] * 4, "task.gain": [1, 1, 2, 2] * 2}
    >>> outcomes = ["CONVERGED", "OUT_OF_IMAGE"] * 4
    >>> figure = study_map(pd.DataFrame({**rows, "outcome": outcomes, "began": True}), *rows)
    >>> [text.get_text().split()[0] for text in figure.axes[0].texts]
    ['100', '0', '100', '0']
    """
    bins = whole_number(bins, "bins", 2, MOST_BINS + 1)
    table = table_columns.get_table(study)
    names = check_column(x, "x", table), check_column(y, "y", table)
    if x == y:
        raise InputError(f"x and y: expected two columns, got {x!r} twice")
    started = table_columns.read_began(table)
    across, up = (bin_column(table, name, bins, started, even=True) for name in names)
    cells = _count_cells(table, across, up)
    told = max(across.many, up.many) <= TOLD
    with figure_style():
        figure = new_figure(7.6 if told else 10.4, 5.2 if told else 4.4, size)
        panels = figure.subplots(1, 1 if told else 2, squeeze=False, sharex=True, sharey=True)[0]
        value = np.array([[100 * each.value for each in row] for row in cells])
        _paint_cells(panels[0], across, up, value, "converged (%)", cmap=_SHARES, vmax=100.0)
        if told:
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
    """Return the share that converged in each cell [up][across], of the runs that began."""
    rows = table_columns.read_began(table) & (across.which >= 0) & (up.which >= 0)
    place = up.which * across.many + across.which
    arrived = rows & (table_columns.read_outcomes(table) == Outcome.CONVERGED)
    many = across.many * up.many
    of, hits = (np.bincount(place[some], minlength=many) for some in (rows, arrived))
    found = [estimate_share(int(hit), int(n)) for hit, n in zip(hits, of, strict=True)]
    return [found[i : i + across.many] for i in range(0, many, across.many)]


def _paint_cells(
    axes: Axes, across: ColumnBins, up: ColumnBins, values: Array, name: str, **colors: Any
) -> None:
    """Paint cells (up, across) in the colours of a scale from 0 on; NaN stays empty."""
    look = colors | {"edgecolors": "white", "linewidth": 0.8 if values.size < 400 else 0}
    cells = np.ma.masked_invalid(values)
    shown = axes.pcolormesh(across.edges, up.edges, cells, vmin=0, **look)
    get_root_figure(axes).colorbar(shown, ax=axes, label=name, aspect=30)
    set_choice_ticks(axes, "x", across)
    set_choice_ticks(axes, "y", up)
    axes.spines[:].set_visible(False)


def _write_cell_numbers(
    axes: Axes, across: ColumnBins, up: ColumnBins, cells: list[list[Estimate]]
) -> None:
    """Write the share, its interval and the number of runs into each cell that has some."""
    middle_x, middle_y = ((each.edges[1:] + each.edges[:-1]) / 2 for each in (across, up))
    for y, row in zip(middle_y, cells, strict=True):
        for x, cell in zip(middle_x, row, strict=True):
            if not cell.of:
                continue
            ends = f"{100 * cell.low:.0f}\N{EN DASH}{100 * cell.high:.0f}"
            text = f"{100 * cell.value:.0f} %\n{ends}\nn {cell.of}"
            color = "white" if cell.value > 0.85 else palette.BLACK
            axes.text(x, y, text, ha="center", va="center", fontsize=6.5, color=color)
