"""Runs as dots, coloured by outcome, by a number, or by a choice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PathCollection
from matplotlib.colors import Colormap, Normalize, to_rgba_array
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.engine.outcome import Outcome
from robsim.plot import palette
from robsim.plot.fitted_legend import add_fitted_legend
from robsim.plot.studies.column_axis import Rows, format_thousands
from robsim.studies import table_columns

if TYPE_CHECKING:
    import pandas as pd

DotPositions = tuple[Array, Array]  # x and y of all rows
AREA, SMALLEST, LARGEST = 4e4, 1.5, 22.0  # square points: all dots together, least and largest dot
MOST = 100_000  # largest number of dots; more would only cover each other
COLORS = "viridis"  # monotonic in lightness, therefore distinct for any colour vision
UNSTARTED = "could not begin"


def shuffle_rows(rows: Rows) -> NDArray[np.intp]:
    """Return the rows to draw in a random order, so that no outcome covers the others.

    The order is reproducible. Of more than 100 000 rows a random sample of 100 000 is returned.
    """
    return np.random.default_rng(0).permutation(np.flatnonzero(rows))[:MOST]


def choose_dot_area(count: int) -> float:
    """Return the area of each of `count` dots, in square points."""
    return float(np.clip(AREA / max(count, 1), SMALLEST, LARGEST))


def draw_dots(
    axes: Axes, x: Array, y: Array, rows: NDArray[np.intp], **look: Any
) -> PathCollection:
    """Draw dots at x, y (all rows,) for the chosen rows, as a raster image in vector files."""
    look = {"s": choose_dot_area(len(rows)), "linewidths": 0, "rasterized": True, **look}
    return axes.scatter(x[rows], y[rows], **look)


def draw_hollow_dots(axes: Axes, x: Array, y: Array, rows: NDArray[np.intp]) -> None:
    """Draw the chosen rows as hollow grey dots, for runs that could not begin."""
    look: dict[str, Any] = {"facecolors": "none", "edgecolors": palette.LIGHT_GREY}
    if rows.size:
        draw_dots(axes, x, y, rows, **look, s=choose_dot_area(x.size), linewidths=0.6, zorder=1)


def build_unstarted_legend(count: int) -> list[Line2D]:
    """Return the legend entry of `count` runs that could not begin."""
    return (
        [_build_dot_handle(f"{UNSTARTED} ({format_thousands(count)})", "none", palette.GREY)]
        if count
        else []
    )


def list_outcome_colors(endings: NDArray[np.int64]) -> Array:
    """Return the colour (rows, 4) of each outcome."""
    table = np.zeros((max(Outcome) + 1, 4))
    for outcome, (color, _) in palette.OUTCOMES.items():
        table[outcome] = to_rgba_array(color)[0]
    return np.asarray(table[endings])


def build_outcome_legend(endings: NDArray[np.int64], rows: Rows) -> list[Line2D]:
    """Return a legend entry for each outcome that occurs in the rows, with its count."""
    counts = {each: int((endings[rows] == each).sum()) for each in palette.OUTCOMES}
    return [
        _build_dot_handle(f"{each.words} ({format_thousands(count)})", palette.OUTCOMES[each][0])
        for each, count in counts.items()
        if count
    ]


def build_choice_legend(groups: table_columns.ColumnGroups, rows: Rows) -> list[Line2D]:
    """Return a legend entry for each value of a choice, with its number of runs."""
    counts = np.bincount(groups.which[rows & (groups.which >= 0)], minlength=len(groups.labels))
    return [
        _build_dot_handle(f"{name} ({format_thousands(int(count))})", palette.cycle_color(i))
        for i, (name, count) in enumerate(zip(groups.labels, counts, strict=True))
    ]


def show_side_legend(axes: Axes, handles: list[Line2D], title: str = "") -> None:
    """Add a legend to the right of the axes, clear of the dots."""
    add_fitted_legend(
        axes,
        handles,
        [str(handle.get_label()) for handle in handles],
        title=title or None,
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        alignment="left",
        handletextpad=0.3,
    )


def build_color_scale(colors: Colormap, low: float, high: float) -> ScalarMappable:
    """Return a scale of colours from low to high, for a colour bar."""
    return ScalarMappable(Normalize(low, high if high > low else low + 1e-12), colors)


def _build_dot_handle(name: str, face: str, edge: str = "none") -> Line2D:
    """Return the legend entry of a dot."""
    look: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 6}
    return Line2D([], [], label=name, markerfacecolor=face, markeredgecolor=edge, **look)


def format_run_total(table: pd.DataFrame, *kinds: Rows) -> str:
    """Return the number of runs, and the number of drawn runs if they are fewer."""
    many, counts = format_thousands(len(table)), [int(kind.sum()) for kind in kinds]
    dots = sum(min(count, MOST) for count in counts)
    return (
        f"{many} runs" if dots == sum(counts) else f"{format_thousands(dots)} of {many} runs drawn"
    )
