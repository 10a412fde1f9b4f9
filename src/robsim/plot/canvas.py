"""Creation of figures: style, size, and management by pyplot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, format_value
from robsim.plot import palette

AxesLike = Axes | Sequence[Axes] | NDArray[np.object_]  # also as `plt.subplots` returns them
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
JOINT_COLUMNS, JOINT_WIDTH, JOINT_HEIGHT, JOINT_TITLE = 3, 3.4, 1.9, 0.4  # sizes in inches
_FILES_ONLY = {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}
_SMALLEST, _LARGEST = 0.5, 100.0  # side of a figure, inches


class UnmanagedFigure(Figure):
    """A figure that pyplot does not manage; notebooks display it as the value of a cell."""

    def _repr_png_(self) -> bytes:
        """Return the figure as PNG, for notebooks with a backend that only writes files."""
        image = BytesIO()
        self.savefig(image, format="png")
        return image.getvalue()


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw in the style of RobSim, and restore the user's settings afterwards.

    Only the settings of `_STYLE` are restored. Choosing a backend may make pyplot interactive, and
    `matplotlib.rc_context` would undo this.
    """
    plt.get_backend()
    before = {key: matplotlib.rcParams[key] for key in _STYLE}
    matplotlib.rcParams.update(_STYLE)
    try:
        yield
    finally:
        matplotlib.rcParams.update(before)


def new_figure(width: float, height: float, size: tuple[float, float] | None = None) -> Figure:
    """Return an empty figure of a width and height in inches; `size` overrides both.

    If the backend opens windows, pyplot manages the figure, and plt.show() shows it. If the backend
    only writes files, and in notebooks, only the caller holds the figure.

    Raise InputError unless `size` is a pair of 0.5 to 100 inches.
    """
    inches = (width, height) if size is None else parse_figure_size(size)
    backend = plt.get_backend().lower()
    if backend in _FILES_ONLY or backend.endswith("inline"):
        return UnmanagedFigure(inches, layout="constrained")
    return plt.figure(figsize=inches, layout="constrained")


def parse_figure_size(size: ArrayLike) -> tuple[float, float]:
    """Return (width, height) in inches; raise InputError unless both are 0.5 to 100."""
    sides = parse_number_pair(size, "size", "(width, height) in inches")
    if min(sides) < _SMALLEST or max(sides) > _LARGEST:
        raise InputError(
            f"size: expected (width, height), each {_SMALLEST:g} to {_LARGEST:g} inches, "
            f"got {format_value(size)}"
        )
    return sides


def parse_number_pair(value: ArrayLike, name: str, words: str) -> tuple[float, float]:
    """Return two finite numbers; the error message describes them by `name` and `words`."""
    two = as_floats(value, f"{name} {words}", (2,))
    if two.ndim != 1:
        raise InputError(f"{name}: expected {words}, got {format_value(value)}")
    return float(two[0]), float(two[1])


def prepare_panels(
    axes: AxesLike | None,
    count: int,
    size: tuple[float, float] | None,
    inches: tuple[float, float],
    columns: int = 1,
    **how: Any,
) -> tuple[Figure, list[Axes]]:
    """Return a figure and its axes: the user's, or the axes of a new figure.

    A new figure has at least `count` axes in `columns` columns, row by row. Its size is `size`, or
    `inches` by default. `how` are keyword arguments of `Figure.subplots`.
    """
    if axes is not None:
        panels = check_panels(axes, count, size)
        return get_root_figure(panels[0]), panels
    figure = new_figure(*inches, size)
    return figure, list(figure.subplots(-(-count // columns), columns, squeeze=False, **how).flat)


def prepare_joint_panels(
    axes: AxesLike | None, count: int, size: tuple[float, float] | None
) -> tuple[Figure, list[Axes]]:
    """Return a figure with one axes over time for each of `count` joints, see `prepare_panels`."""
    columns = _count_joint_columns(count)
    inches = columns * JOINT_WIDTH, -(-count // columns) * JOINT_HEIGHT + JOINT_TITLE
    return prepare_panels(axes, count, size, inches, columns, sharex=True)


def label_joint_panels(panels: Sequence[Axes], count: int) -> None:
    """Label the lowest axes of the columns of a new figure, and hide the axes without a joint."""
    columns = _count_joint_columns(count)
    for i, panel in enumerate(panels):
        panel.set_axis_on() if i < count else panel.set_axis_off()
        below = i + columns >= count
        panel.set_xlabel("time (s)" if below else "")
        panel.tick_params(labelbottom=below)


def _count_joint_columns(count: int) -> int:
    return min(JOINT_COLUMNS if count != 4 else 2, count)


def check_panels(axes: AxesLike, count: int, size: tuple[float, float] | None) -> list[Axes]:
    """Return the user's axes as a list of length `count`.

    Raise InputError if the number or type of the axes is wrong, or if `size` is given as well.
    """
    if size is not None:
        raise InputError("size applies to a new figure only: omit it if axes are given")
    many = axes.ravel() if isinstance(axes, np.ndarray) else axes
    panels = list(many) if isinstance(many, Sequence | np.ndarray) else [many]
    if len(panels) != count or not all(isinstance(each, Axes) for each in panels):
        expected = "one Axes" if count == 1 else f"{count} Axes"
        raise InputError(
            f"expected {expected} of Matplotlib to draw into, got {format_value(axes)}"
        )
    return panels


def get_root_figure(axes: Axes) -> Figure:
    """Return the figure that contains the axes."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    return figure


def replace_frame_by_grid(axes: Axes, grid: Literal["x", "y", "both"] = "both") -> None:
    """Show grid lines instead of a frame."""
    axes.grid(True, axis=grid)
    axes.spines[["top", "right"]].set_visible(False)


def set_time_axis(axes: Axes, time: Array) -> None:
    """Set limits, label and grid of a time axis that shows all times (T,) in seconds."""
    axes.set(xlabel="time (s)", xlim=(0, time[-1] if time[-1] > 0 else 1))
    replace_frame_by_grid(axes)


def marker_of_single_point(time: Array) -> dict[str, Any]:
    """Return the marker of a line with a single point, which is invisible without a marker."""
    return {"marker": "."} if len(time) == 1 else {}


def set_axes_title(axes: Axes, default: str, title: str | None) -> None:
    """Set the user's title, or the default title if it is None."""
    axes.set_title(default if title is None else title)
