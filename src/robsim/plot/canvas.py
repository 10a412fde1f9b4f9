"""Where figures come from: their look, and whether pyplot keeps them."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import matplotlib
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from robsim.plot import palette

_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 10,
    "figure.titlesize": 11,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "axes.linewidth": 0.8,
    "grid.color": palette.LIGHT_GREY,
    "grid.linewidth": 0.5,
}
_FILES_ONLY = {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}


def style() -> AbstractContextManager[None]:
    """The look of our figures, while one is drawn; what the user has set comes back after it."""
    return matplotlib.rc_context(_STYLE)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, in inches.

    Where Matplotlib opens windows, pyplot knows it, so that plt.show() shows it; where it only
    writes files, nobody but the caller keeps it, and any number can be made.
    """
    if plt.get_backend().lower() in _FILES_ONLY:
        return Figure((width, height), layout="constrained")
    return plt.figure(figsize=(width, height), layout="constrained")
