"""Legends that take at most a fifth of their figure, for any number of entries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from robsim.plot.canvas import get_root_figure

SHARE = 0.2  # largest area of a legend, as a share of the area of its figure
SIZES = (9.0, 8.0, 7.0)  # font sizes, points
LONGEST = 32  # characters of a name; longer names are cut in the middle


def add_fitted_legend(
    owner: Axes | Figure, handles: Sequence[Artist], labels: Sequence[str], **place: Any
) -> Legend:
    """Add a legend to axes or a figure, with smaller letters or fewer entries if it is too large.

    Long names are cut in the middle. The last entry counts the entries that are left out. `place`
    are keywords of `Axes.legend`.
    """
    figure = owner if isinstance(owner, Figure) else get_root_figure(owner)
    allowed = SHARE * figure.bbox.width * figure.bbox.height
    names = [shorten_name(label) for label in labels]
    fewer = range(len(names) - 2, 0, -max(1, len(names) // 12))
    tries = [*((len(names), size) for size in SIZES), *((kept, SIZES[-1]) for kept in fewer)]
    for i, (kept, size) in enumerate(tries):
        shown = list(handles[:kept]), names[:kept]
        if kept < len(names):
            shown[0].append(Line2D([], [], linestyle="none"))
            shown[1].append(f"and {len(names) - kept} more")
        legend = owner.legend(*shown, **{"frameon": False, "fontsize": size} | place)
        extent = legend.get_tightbbox()
        if extent is None or extent.width * extent.height <= allowed or i == len(tries) - 1:
            break
        legend.remove()
    return legend


def shorten_name(name: str) -> str:
    """Return a name of at most 32 characters, with an ellipsis in its middle if it is longer.

    >>> shorten_name("a very long name of a run that nobody reads")
    'a very long name…hat nobody reads'
    """
    half = LONGEST // 2
    return name if len(name) <= LONGEST else f"{name[:half]}…{name[-half:]}"
