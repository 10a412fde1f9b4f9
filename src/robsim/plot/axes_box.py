"""The box of a 3-D figure: equal scales, a ground, and a zoom that fills the axes."""

from __future__ import annotations

from itertools import product

import numpy as np
from matplotlib.ticker import MaxNLocator, MultipleLocator
from mpl_toolkits.mplot3d import Axes3D, proj3d  # type: ignore[import-untyped]
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError
from robsim.plot import palette
from robsim.plot.canvas import parse_number_pair

VIEW = (22.0, -55.0)  # elevation and azimuth, degrees
FLATTEST = 0.4  # least side of the box, as a share of its longest side
WIDEST = 1e30  # metres; projections of larger scenes are not finite
FILLED = 0.72  # share of the user's axes that the box fills; the rest is for labels
LABELS = (0.3, 0.52, 0.68, 0.1)  # inches for labels left of, below, right of and above the box
GROUND = "#f4f4f1"
TICK, LABEL = (10.0, 10.0, 18.0), (27.0, 27.0, 42.0)  # distances from the edges of x, y, z, points
Box = tuple[Array, Array]  # the lowest and the highest corner (3,), in metres


class InnerTicks(MultipleLocator):
    """Tick locator at multiples of a step, without ticks near corners: labels would overlap."""

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the ticks in the inner part of the axis."""
        edge = 0.09 * (vmax - vmin)
        return [t for t in super().tick_values(vmin, vmax) if vmin + edge <= t <= vmax - edge]


def parse_view(view: tuple[float, float] | None) -> tuple[float, float]:
    """Return the view (elevation, azimuth) in degrees; None is the default view.

    Raise InputError unless it is two finite numbers.
    """
    return (
        VIEW if view is None else parse_number_pair(view, "view", "(elevation, azimuth) in degrees")
    )


def check_3d_axes(axes: object) -> Axes3D:
    """Return the axes; raise InputError unless they are 3-D."""
    if not isinstance(axes, Axes3D):
        raise InputError(
            f"ax: expected 3-D axes, as plt.subplots(subplot_kw={{'projection': '3d'}}) gives, "
            f"got {type(axes).__name__}"
        )
    return axes


def compute_axes_box(points: Array, bounds: ArrayLike | None = None) -> Box:
    """Return the lowest and highest corner (3,) of a box around points (N, 3), in metres.

    Every side has a minimum length, and the lowest point is on the floor. `bounds` (2, 3) are the
    corners, if given. Raise InputError if `bounds` is not a lowest and a highest corner, or if the
    points are too far apart.
    """
    if bounds is not None:
        corners = as_floats(bounds, "bounds (lowest, highest) in metres", (2, 3))
        if corners.ndim != 2 or (corners[0] >= corners[1]).any():
            raise InputError(f"bounds: expected the lowest and the highest corner, got {bounds!r}")
        return corners[0], corners[1]
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float((high - low).max()) or 1.0
    if not longest < WIDEST:
        raise InputError(f"a scene that is {longest:.3g} m wide cannot be drawn")
    grow = np.maximum(FLATTEST * longest - (high - low), 0.06 * longest)
    return low - grow * (0.5, 0.5, 0), high + grow * (0.5, 0.5, 1)


def set_box_axes(axes: Axes3D, low: Array, high: Array, view: tuple[float, float]) -> None:
    """Set limits, ticks and view of 3-D axes, with one tick step on all axes."""
    step = np.diff(MaxNLocator(6).tick_values(0, float((high - low).max())))[0]
    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{name}lim")(a, b)
        getattr(axes, f"set_{name}label")(f"{name} (m)")
        axis = getattr(axes, f"{name}axis")
        axis.set_major_locator(InnerTicks(step))
        floor = GROUND if name == "z" else "white"
        axis.pane.set(facecolor=floor, edgecolor=palette.LIGHT_GREY, alpha=1.0)
    axes.set_aspect("equal")
    axes.set_proj_type("ortho")  # lengths along an axis can be compared
    axes.view_init(elev=view[0], azim=view[1])
    axes.set_box_aspect(high - low)


def compute_box_aspect(low: Array, high: Array, view: tuple[float, float]) -> float:
    """Return the width of the projected box divided by its height."""
    width, height = np.ptp(_project_box_to_paper(low, high, view), axis=0)
    return float(width / height)


def fit_box_to_axes(axes: Axes3D, low: Array, high: Array) -> None:
    """Enlarge the box to fill the user's axes, with room for its labels."""
    extent = np.ptp(_project_box_to_axes(axes, low, high), axis=0)
    inches = axes.get_window_extent().size / axes.get_figure(root=True).dpi
    _zoom_box(axes, low, high, FILLED / float(extent.max()), float(inches.min()))


def fit_box_to_page(
    axes: Axes3D, low: Array, high: Array, width: float, height: float, top: float = 0.0
) -> None:
    """Enlarge the box to fill a page of width and height in inches, except for labels and `top`.

    The box is not centred in its square axes. The axes are shifted, so that the box is centred in
    the free part of the page.
    """
    left, below, right, above = LABELS
    corners = _project_box_to_axes(axes, low, high)
    extent, middle = np.ptp(corners, axis=0), (corners.min(axis=0) + corners.max(axis=0)) / 2
    free = np.array([width - left - right, height - below - above - top])
    side = min(width, height)
    zoom = float((np.maximum(free, 0.3 * side) / (side * extent)).min())
    centre = np.array([left, below]) + free / 2 - zoom * (middle - 0.5) * side
    corner = (centre - side / 2) / (width, height)
    axes.set_position((*corner, side / width, side / height))
    _zoom_box(axes, low, high, zoom, side)


def _zoom_box(axes: Axes3D, low: Array, high: Array, zoom: float, side: float) -> None:
    """Enlarge the box in square axes of `side` inches, with labels at a fixed distance from it.

    Matplotlib measures the distance of a label in shares of the sides of the box. The length of
    such a share on paper depends on the axis, the box and the zoom.
    """
    corners, sides = _project_box_to_paper(low, high, (axes.elev, axes.azim)), high - low
    inches = (
        zoom
        * side
        * np.ptp(_project_box_to_axes(axes, low, high), axis=0)
        / np.ptp(corners, axis=0)
    )
    axes.set_box_aspect(sides.copy(), zoom=zoom)  # copied: Matplotlib writes into its argument
    onto = _compute_paper_directions((axes.elev, axes.azim)) * inches.mean()
    facing = np.array([np.cos(np.radians(axes.azim)), np.sin(np.radians(axes.azim)), -axes.elev])
    per_pad = 0.08 * 48 / (2 * 72 * side)
    for i, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        outside = np.sign(onto[0] if i == 2 else facing) * (np.arange(3) != i)
        along, away = onto[:, i], onto @ (outside * sides * per_pad)
        straight = along[0] * away[1] - along[1] * away[0]
        reach = max(abs(straight) / (np.hypot(*along) or 1.0), 1e-6 / side)
        axis.set_tick_params(pad=TICK[i] / 72 / reach - 8)
        axis.labelpad = LABEL[i] / 72 / reach - 21


def _project_box_to_axes(axes: Axes3D, low: Array, high: Array) -> Array:
    """Return the corners (8, 2) of the box at zoom 1, as shares of its square axes."""
    axes.set_box_aspect(high - low)
    x, y, _ = proj3d.proj_transform(*_list_box_corners(low, high).T, axes.get_proj())
    return np.asarray(axes.transLimits.transform(np.column_stack([x, y])))


def _project_box_to_paper(low: Array, high: Array, view: tuple[float, float]) -> Array:
    """Return the corners (8, 2) of the projected box in metres, to the right and up."""
    return _list_box_corners(low, high) @ _compute_paper_directions(view).T


def _list_box_corners(low: Array, high: Array) -> Array:
    """Return the corners (8, 3) of the box."""
    return np.array(list(product(*zip(low, high, strict=True))))


def _compute_paper_directions(view: tuple[float, float]) -> Array:
    """Return the directions (2, 3) to the right and up on paper, in the frame of the figure."""
    elevation, azimuth = np.radians(view)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    ahead = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    up = np.array([0, 0, np.cos(elevation)]) - np.sin(elevation) * ahead
    return np.stack([right, up])
