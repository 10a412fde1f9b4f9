"""The 3-D window: a scene with ground and shading, at one moment or over a run."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure, SubFigure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D

from robsim.plot import axes_box, palette, shaded_solids
from robsim.plot.axes_box import Box
from robsim.plot.canvas import check_panels, figure_style, get_root_figure, new_figure
from robsim.plot.scene_content import SceneContent, build_scene_content
from robsim.plot.wireframe import WireSolid

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

HEIGHT, NARROWEST, WIDEST = 4.8, 3.6, 8.4  # inches: of the figure, and the width of its drawing
TITLE = 0.35  # inches, of a title
ROWS = 18  # of a legend at the most
BEFORE_BEHIND, ON_TOP = 3, 9
_BEFORE: dict[str, Any] = {"color": palette.GREY, "linestyle": (0, (4, 2)), "linewidth": 0.8}
_GOAL: dict[str, Any] = {"color": palette.GOAL, "linestyle": (0, (1.5, 1)), "linewidth": 1.6}
_PATH: dict[str, Any] = {"linewidth": 2.4}
_MARK: dict[str, Any] = {"marker": palette.ASTERISK, "markersize": 7, "linestyle": "none"}
_DOT: dict[str, Any] = {"marker": "o", "markersize": 4}


def scene(
    scene: Scene,
    q: Any = None,
    run: xr.Dataset | None = None,
    *,
    goal: Any = None,
    ax: Any = None,
    view: Any = None,
    bounds: Any = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw the scene in 3-D, in metres: at q (nq,), home by default, or over one `run`.

    Every solid has its own colour (a robot all in black, the default, gets a colour per link; one
    of any other single colour is one entry of the legend); marks are asterisks. The start of a run
    is dashed, its end solid, and the paths of cameras and objects are lines. Everything is seen
    from the frame of `scene.display`; the ground is as high as the lowest point.

    goal    drawn as a dotted outline: q (nq,), a task, its goal, or a pose in the world: of the
            camera; where that stands still of the target; without cameras of the robot's tip.
            None takes that of the run, if it has one
    ax      3-D axes to draw into, instead of a new figure
    view    (elevation, azimuth) in degrees, (22, -55) by default
    bounds  (lowest, highest) corner of the box, (2, 3) in metres, to give several figures the same
    size    (width, height) of the figure, inches

    InputError: something that cannot be drawn; the message says what is expected.

    >>> from robsim import Robot, Scene
    >>> figure = scene(Scene(Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]])), q=[0.5, 1.0])
    >>> figure.axes[0].get_xlabel()
    'x (m)'
    """
    return draw_scene_figure(
        build_scene_content(scene, q, run, goal), ax, view, bounds, size, title
    )


def draw_scene_figure(
    picture: SceneContent, ax: Any, view: Any, bounds: Any, size: Any, title: str | None
) -> Figure:
    """Draw the picture into a new figure, or into the user's axes."""
    seen, box = axes_box.parse_view(view), axes_box.compute_axes_box(picture.points, bounds)
    with figure_style():
        if ax is not None:
            (axes,) = check_panels(axes_box.check_3d_axes(ax), 1, size)
            _draw_scene_into_axes(axes, picture, box, seen)
            axes_box.fit_box_to_axes(axes, *box)
            below = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.02), "fontsize": 8}
            _draw_scene_legend(axes, picture, below | {"ncols": 3})
            axes.set_title(title or "")
            return get_root_figure(axes)
        figure = new_figure(measure_scene_width(picture, HEIGHT, seen, box), HEIGHT, size)
        figure.set_layout_engine("none")  # the drawing is placed by hand
        axes = draw_scene(figure, picture, box, seen).axes
        arrange_scene(figure, axes, picture, box, TITLE if title else 0.0)
        if title:
            figure.suptitle(title)
    return figure


@dataclass(frozen=True)
class SceneArtists:
    """What is drawn of a picture in 3-D axes, to be moved."""

    axes: Any
    solids: list[shaded_solids.MovableArtist]
    outlines: list[Any]
    paths: list[tuple[Any, Any]]  # line and dot at its end, in the order of the picture
    marks: list[Any]

    @property
    def artists(self) -> list[Any]:
        """All that is drawn."""
        moved, paths = [each.artist for each in self.solids], chain.from_iterable(self.paths)
        return [*moved, *self.outlines, *paths, *self.marks]


def draw_scene(
    figure: Figure | SubFigure, picture: SceneContent, box: Box, view: Any
) -> SceneArtists:
    """Draw the picture into a figure or a part of one, in axes that `arrange_scene` places."""
    axes: Any = figure.add_axes((0, 0, 1, 1), projection="3d")
    return _draw_scene_into_axes(axes, picture, box, axes_box.parse_view(view))


def arrange_scene(
    figure: Figure | SubFigure, axes: Any, picture: SceneContent, box: Box, top: float = 0.0
) -> None:
    """Make a drawing fill the figure, or its part of it, except for `top` inches.

    The legend is on the right. The figure must have its final size.
    """
    width, height = (float(side) / figure.dpi for side in (figure.bbox.width, figure.bbox.height))
    aside = measure_legend_width(picture)
    axes_box.fit_box_to_page(axes, *box, width - aside, height, top)
    left, bottom, wide, tall = axes.get_position(original=True).bounds
    share = 1 - aside / width
    axes.set_position((left * share, bottom, wide * share, tall))
    right = (share, 0.5)
    place = {"loc": "center left", "bbox_to_anchor": right, "bbox_transform": figure.transSubfigure}
    _draw_scene_legend(axes, picture, place)


def measure_scene_width(picture: SceneContent, height: float, view: Any, box: Box) -> float:
    """Return the width in inches that picture and legend take at a height in inches."""
    left, below, right, above = axes_box.LABELS
    shape = axes_box.compute_box_aspect(*box, axes_box.parse_view(view))
    wide = (height - below - above) * shape + left + right
    return float(np.clip(wide, NARROWEST, WIDEST)) + measure_legend_width(picture)


def measure_legend_width(picture: SceneContent) -> float:
    """Return the width of the legend in inches."""
    names = [name for name, _ in _build_legend_entries(picture)]
    columns = -(-len(names) // ROWS)
    return columns * (0.6 + 0.07 * max(map(len, names))) if names else 0.0


def _draw_scene_into_axes(
    axes: Any, picture: SceneContent, box: Box, view: tuple[float, float]
) -> SceneArtists:
    axes.computed_zorder = False
    axes_box.set_box_axes(axes, *box, view)
    drawn = shaded_solids.draw_shadows(axes, picture.solid, float(box[0][2])) if view[0] > 0 else []
    behind, front = _BEFORE | {"zorder": BEFORE_BEHIND}, _GOAL | {"zorder": ON_TOP}
    begun = [(wire, f"{wire.label} at start", behind) for wire in picture.before]
    goals = [(wire, f"goal of {wire.label}", front) for wire in picture.goal]
    outlines = [shaded_solids.draw_solid_outline(axes, *each) for each in begun]
    drawn += shaded_solids.draw_solids(axes, picture.solid)
    outlines += [shaded_solids.draw_solid_outline(axes, *each) for each in goals]
    return SceneArtists(
        axes, drawn, outlines, _draw_body_paths(axes, picture), _draw_scene_marks(axes, picture)
    )


def _draw_body_paths(axes: Any, picture: SceneContent) -> list[tuple[Any, Any]]:
    drawn = []
    for (name, path), color in zip(
        picture.paths.items(), _choose_path_colors(picture), strict=True
    ):
        look = _PATH | {"color": color, "zorder": ON_TOP, "clip_on": False}
        (line,) = axes.plot(*path.T, **look, label=f"path of {name}")
        (dot,) = axes.plot(*path[-1:].T, **look, **_DOT)
        drawn.append((line, dot))
    return drawn


def _draw_scene_marks(axes: Any, picture: SceneContent) -> list[Any]:
    look = _MARK | {"zorder": ON_TOP, "clip_on": False}
    pairs = zip(picture.marks, picture.mark_colors, strict=True)
    return [axes.plot(*mark[:, None], **look, color=color)[0] for mark, color in pairs]


def _choose_path_colors(picture: SceneContent) -> list[str]:
    """Return a colour for each path, different from those of the solids."""
    taken = [wire.color for wire in picture.solid]
    for _ in picture.paths:
        taken.append(palette.find_unused_color([*taken, palette.BLACK]))
    return taken[len(picture.solid) :]


def _draw_scene_legend(axes: Any, picture: SceneContent, place: dict[str, Any]) -> None:
    handles = _build_legend_entries(picture)
    if handles:
        axes.legend(
            [handle for _, handle in handles],
            [name for name, _ in handles],
            handler_map={tuple: HandlerTuple(ndivide=None, pad=0.0)},
            frameon=False,
            **{"ncols": -(-len(handles) // ROWS)} | place,
        )


def _group_names_by_color(wires: list[WireSolid]) -> dict[str, list[str]]:
    """Return {colour: names}, with each name once.

    A thing of several colours is listed under its most frequent one, but if possible not under the
    single colour of another thing.
    """
    amounts: dict[str, dict[str, float]] = {}
    for wire in wires:
        of = amounts.setdefault(wire.label, {})
        long = float(np.linalg.norm(np.diff(wire.segments, axis=1), axis=2).sum())
        of[wire.color] = of.get(wire.color, 0.0) + long
    only = {color for of in amounts.values() if len(of) == 1 for color in of}
    named: dict[str, list[str]] = {}
    for name, of in amounts.items():
        chosen = max(of, key=lambda color: (color not in only, of[color]))
        named.setdefault(chosen, []).append(name)
    return named


def _build_legend_entries(picture: SceneContent) -> list[tuple[str, Any]]:
    """Return a legend entry for each colour; things of one colour share an entry."""
    thick: dict[str, Any] = {"linewidth": 5, "solid_capstyle": "butt"}
    handles: list[tuple[str, Any]] = [
        (_abbreviate_names(names), Line2D([], [], color=palette.tint_color(color, 0.15), **thick))
        for color, names in _group_names_by_color(picture.solid).items()
    ]
    if picture.before:
        handles.append(("start", Line2D([], [], **_BEFORE)))
    if picture.goal:
        handles.append(("goal", Line2D([], [], **_GOAL)))
    if len(picture.marks):
        some = list(dict.fromkeys(picture.mark_colors))[:3]
        handles.append(("marks", tuple(Line2D([], [], **_MARK, color=color) for color in some)))
    for name, color in zip(picture.paths, _choose_path_colors(picture), strict=True):
        handles.append((f"path of {name}", Line2D([], [], **_PATH, **_DOT, color=color)))
    return handles


def _abbreviate_names(names: list[str]) -> str:
    """Return up to three names; of more, the first, the last and their number."""
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]} … {names[-1]} ({len(names)})"
