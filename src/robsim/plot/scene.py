"""The 3-D window: a scene as wire frames, at one moment or over a run (chapter, figs 13, 14)."""

from __future__ import annotations

from itertools import cycle, product
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator
from mpl_toolkits.mplot3d import proj3d  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import (  # type: ignore[import-untyped]
    Line3DCollection,
    Poly3DCollection,
)

from robsim.base.arrays import Array
from robsim.plot import palette
from robsim.plot.canvas import new_figure, style
from robsim.plot.picture import Picture, picture_of
from robsim.plot.wireframe import Wire

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

DRAWING = 4.6  # inches, the width of the drawing beside its legend
FILLED = 0.73  # share of the axes that the box takes; the rest is for its labels
PLACE = (-0.07, -0.3, 1.0, 1.6)  # of the axes: labels are on the right; they may be as high as wide
FLATTEST = 0.5  # the shortest side of the drawn box, as a share of its longest
ON_TOP = 1000  # of solids, which Matplotlib sorts by their distance
_BEFORE: dict[str, Any] = {"color": palette.GREY, "linestyle": (0, (4, 2)), "linewidth": 0.8}
_PATH: dict[str, Any] = {"linewidth": 2.2}
_PATHS = (palette.VERMILLION, palette.PURPLE, palette.ORANGE)
_MARK: dict[str, Any] = {"marker": palette.ASTERISK, "markersize": 7, "linestyle": "none"}
_DOT: dict[str, Any] = {"marker": "o", "markersize": 4}


class InnerTicks(MultipleLocator):
    """Multiples of a step away from the corners, where the labels of two axes would meet."""

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Those in the inner part of the axis."""
        edge = 0.06 * (vmax - vmin)
        return [t for t in super().tick_values(vmin, vmax) if vmin + edge <= t <= vmax - edge]


def scene(scene: Scene, q: Any = None, run: xr.Dataset | None = None) -> Figure:
    """The scene in 3-D, in metres: at q (nq,), home by default, or from start to end of one `run`.

    Every solid is drawn by its edges in its own colour (a robot all in black, the default, gets a
    colour per link; one of any other single colour is one entry of the legend); marks are
    asterisks. Of a run the start is dashed, the end solid, and the paths of cameras and objects are
    lines. Everything is seen from the frame of `scene.display`.

    >>> from robsim import Robot, Scene
    >>> figure = scene(Scene(Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]])), q=[0.5, 1.0])
    >>> figure.axes[0].get_xlabel()
    'x (m)'
    """
    return drawn(picture_of(scene, q, run))


def drawn(picture: Picture) -> Figure:
    """The picture as a figure of its own."""
    with style():
        figure = new_figure(DRAWING + legend_width(picture), 4.6)
        draw(figure, figure.add_gridspec(1, 1)[0], picture)
    return figure


def draw(figure: Figure, place: SubplotSpec, picture: Picture) -> None:
    """Draw the picture into 3-D axes, with its legend on the right."""
    share = DRAWING / (DRAWING + legend_width(picture))
    left, bottom, width, height = PLACE
    rectangle = (left * share, bottom, width * share, height)
    axes: Any = figure.add_subfigure(place).add_axes(rectangle, projection="3d")
    for wire in picture.solid:
        _draw_solid(axes, wire)
    for wire in picture.before:
        _draw_before(axes, wire)
    for (name, path), color in zip(picture.paths.items(), cycle(_PATHS), strict=False):
        look = _PATH | {"color": color}
        axes.plot(*path.T, **look, zorder=ON_TOP, label=f"path of {name}")
        axes.plot(*path[-1:].T, **look, **_DOT, zorder=ON_TOP)
    for mark, color in zip(picture.marks, picture.mark_colors, strict=True):
        axes.plot(*mark[:, None], **_MARK, color=color, zorder=ON_TOP)
    _frame(axes, picture.points)
    handles = _handles(picture)
    if handles:
        axes.legend(handles=handles, loc="center left", bbox_to_anchor=(1.1, 0.5), frameon=False)


def legend_width(picture: Picture) -> float:
    """Inches that the legend takes."""
    return 0.85 + 0.075 * max((len(str(h.get_label())) for h in _handles(picture)), default=0)


def _draw_solid(axes: Any, wire: Wire) -> None:
    look = {"facecolors": wire.color, "alpha": 0.07, "linewidths": 0}
    for size in sorted({len(face) for face in wire.faces}):
        # apart, because Matplotlib pads faces of unequal size with whatever is in the memory
        faces = [face for face in wire.faces if len(face) == size]
        axes.add_collection3d(Poly3DCollection(faces, **look), autolim=False)
    look = {"colors": wire.color, "linewidths": 1.2}
    axes.add_collection3d(Line3DCollection(wire.segments, **look, label=wire.label), autolim=False)


def _draw_before(axes: Any, wire: Wire) -> None:
    look = {f"{name}s": value for name, value in _BEFORE.items()}  # plural in collections
    axes.add_collection3d(
        Line3DCollection(wire.segments, **look, label=f"{wire.label} at start"), autolim=False
    )


def _frame(axes: Any, points: Array) -> None:
    """True proportions: the box has the sides of its limits; what is lowest stands on its floor."""
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float((high - low).max()) or 1.0
    grow = np.maximum(FLATTEST * longest - (high - low), 0.06 * longest)
    low, high = low - grow * (0.5, 0.5, 0), high + grow * (0.5, 0.5, 1)
    step = np.diff(MaxNLocator(6).tick_values(0, longest))[0]  # one for all: the grid is of squares
    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{name}lim")(a, b)
        getattr(axes, f"set_{name}label")(f"{name} (m)")
        axis = getattr(axes, f"{name}axis")
        axis.set_major_locator(InnerTicks(step))
        axis.set_tick_params(pad=9 if name == "z" else 0)
        axis.labelpad = 20 if name == "z" else 8
        axis.pane.set(facecolor="white", edgecolor=palette.LIGHT_GREY)
    axes.set_aspect("equal")
    axes.view_init(elev=22, azim=-55)
    axes.set_box_aspect(high - low, zoom=FILLED / _share(axes, low, high))


def _share(axes: Any, low: Array, high: Array) -> float:
    """How much of the axes the box fills, as it is seen: its width or height, from 0 to 1."""
    corners = np.array(list(product(*zip(low, high, strict=True))))
    x, y, _ = proj3d.proj_transform(*corners.T, axes.get_proj())
    return float(np.ptp(axes.transLimits.transform(np.column_stack([x, y])), axis=0).max())


def _handles(picture: Picture) -> list[Line2D]:
    """One legend entry for each name."""
    handles = {w.label: Line2D([], [], color=w.color, label=w.label) for w in picture.solid}
    if picture.before:
        handles["start"] = Line2D([], [], **_BEFORE, label="start")
    if len(picture.marks):
        handles["marks"] = Line2D([], [], **_MARK, color="k", label="marks")
    for name, color in zip(picture.paths, cycle(_PATHS), strict=False):
        look = _PATH | _DOT | {"color": color}
        handles[f"path of {name}"] = Line2D([], [], **look, label=f"path of {name}")
    return list(handles.values())
