"""Figure of a scene in 3-D with ground and shading, at one configuration or over a run."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure, SubFigure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from numpy.typing import ArrayLike

from robsim.plot import axes_box, palette, shaded_solids
from robsim.plot.axes_box import Box
from robsim.plot.canvas import check_panels, figure_style, get_root_figure, new_figure
from robsim.plot.goal_outlines import DrawableGoal
from robsim.plot.scene_content import SceneContent, build_scene_content
from robsim.plot.wireframe import WireSolid

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

HEIGHT, NARROWEST, WIDEST = 4.8, 3.6, 8.4  # inches: the figure, and the width of its box
TITLE = 0.35  # height of a title, inches
ROWS = 18  # largest number of rows of a legend
BEFORE_BEHIND, ON_TOP = 3, 9
_BEFORE: dict[str, Any] = {"color": palette.GREY, "linestyle": (0, (4, 2)), "linewidth": 0.8}
_GOAL: dict[str, Any] = {"color": palette.GOAL, "linestyle": (0, (1.5, 1)), "linewidth": 1.6}
_PATH: dict[str, Any] = {"linewidth": 2.4}
_MARK: dict[str, Any] = {"marker": palette.ASTERISK, "markersize": 7, "linestyle": "none"}
_DOT: dict[str, Any] = {"marker": "o", "markersize": 4}


def scene(
    scene: Scene,
    q: ArrayLike | None = None,
    run: xr.Dataset | None = None,
    *,
    goal: DrawableGoal | None = None,
    ax: Axes3D | None = None,
    view: tuple[float, float] | None = None,
    bounds: ArrayLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the scene in 3-D, in metres, at one configuration or over a run.

    Every solid has its own colour. The links of a black robot (the default colour) get different
    colours; a robot of another single colour has one entry in the legend. Asterisks are the feature
    points of the objects. If a run is given, the start is dashed, the end solid, and lines are the
    paths of the cameras and objects that move. The figure is in the frame `scene.display`, and the
    ground is at the height of the lowest point.

    Parameters
    ----------
    scene : Scene
        Scene to draw.
    q : array_like of shape (nq,), optional
        Configuration. Default: the home configuration.
    run : xarray.Dataset, optional
        A single run of the scene, drawn instead of a configuration.
    goal : array_like of shape (nq,), Pose, ServoTask or the goal of a task, optional
        Goal to draw as a dotted outline. A pose in the world is the goal of the first camera or
        object that a robot moves, or of the tip of the first robot if the robots move neither.
        Default: the goal stored in `run`, if any.
    ax : Axes3D, optional
        3-D axes to draw into. Default: the axes of a new figure.
    view : (float, float), optional
        Elevation and azimuth of the viewing direction in degrees. Default: (22, -55).
    bounds : array_like of shape (2, 3), optional
        Lowest and highest corner of the drawn box in metres. Give the same bounds to several
        figures to compare them. Default: chosen to fit the content.
    size : (float, float), optional
        Width and height of a new figure in inches. Default: chosen to fit the content.
    title : str, optional
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `ax`.

    Raises
    ------
    InputError
        If both `q` and `run` are given, the run belongs to another scene, or an option is invalid.

    Examples
    --------
    >>> from robsim import Robot, Scene
    >>> figure = scene(Scene(Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]])), q=[0.5, 1.0])
    >>> figure.axes[0].get_xlabel()
    'x (m)'
    """
    return draw_scene_figure(
        build_scene_content(scene, q, run, goal), ax, view, bounds, size, title
    )


def draw_scene_figure(
    content: SceneContent,
    ax: Axes3D | None,
    view: tuple[float, float] | None,
    bounds: ArrayLike | None,
    size: tuple[float, float] | None,
    title: str | None,
) -> Figure:
    """Draw the content into a new figure, or into the user's axes."""
    angles, box = axes_box.parse_view(view), axes_box.compute_axes_box(content.points, bounds)
    with figure_style():
        if ax is not None:
            (axes,) = check_panels(axes_box.check_3d_axes(ax), 1, size)
            _draw_scene_into_axes(axes, content, box, angles)
            axes_box.fit_box_to_axes(axes, *box)
            below = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.02), "fontsize": 8}
            _draw_scene_legend(axes, content, below | {"ncols": 3})
            axes.set_title(title or "")
            return get_root_figure(axes)
        figure = new_figure(measure_scene_width(content, HEIGHT, angles, box), HEIGHT, size)
        figure.set_layout_engine("none")  # `arrange_scene` places the axes
        axes = draw_scene(figure, content, box, angles).axes
        arrange_scene(figure, axes, content, box, TITLE if title else 0.0)
        if title:
            figure.suptitle(title)
    return figure


@dataclass(frozen=True)
class SceneArtists:
    """The artists of a scene in 3-D axes; a film moves them."""

    axes: Axes3D
    solids: list[shaded_solids.MovableArtist]
    outlines: list[Artist]
    paths: list[tuple[Any, Any]]  # line and dot at its end, one pair for each path
    marks: list[Any]

    @property
    def artists(self) -> list[Artist]:
        """All artists, in drawing order."""
        solids, paths = [each.artist for each in self.solids], chain.from_iterable(self.paths)
        return [*solids, *self.outlines, *paths, *self.marks]


def draw_scene(
    figure: Figure | SubFigure, content: SceneContent, box: Box, view: tuple[float, float] | None
) -> SceneArtists:
    """Draw the content into new axes of a figure or subfigure; `arrange_scene` places the axes."""
    axes: Axes3D = figure.add_axes((0, 0, 1, 1), projection="3d")
    return _draw_scene_into_axes(axes, content, box, axes_box.parse_view(view))


def arrange_scene(
    figure: Figure | SubFigure, axes: Axes3D, content: SceneContent, box: Box, top: float = 0.0
) -> None:
    """Enlarge a drawing until it fills its figure or subfigure, except for `top` inches.

    The legend is on the right. The figure must have its final size.
    """
    width, height = (float(side) / figure.dpi for side in (figure.bbox.width, figure.bbox.height))
    aside = measure_legend_width(content)
    axes_box.fit_box_to_page(axes, *box, width - aside, height, top)
    left, bottom, wide, tall = axes.get_position(original=True).bounds
    share = 1 - aside / width
    axes.set_position((left * share, bottom, wide * share, tall))
    right = (share, 0.5)
    place = {"loc": "center left", "bbox_to_anchor": right, "bbox_transform": figure.transSubfigure}
    _draw_scene_legend(axes, content, place)


def measure_scene_width(
    content: SceneContent, height: float, view: tuple[float, float] | None, box: Box
) -> float:
    """Return the width in inches that the scene and its legend need at a height in inches."""
    left, below, right, above = axes_box.LABELS
    shape = axes_box.compute_box_aspect(*box, axes_box.parse_view(view))
    wide = (height - below - above) * shape + left + right
    return float(np.clip(wide, NARROWEST, WIDEST)) + measure_legend_width(content)


def measure_legend_width(content: SceneContent) -> float:
    """Return the width of the legend in inches."""
    names = [name for name, _ in _build_legend_entries(content)]
    columns = -(-len(names) // ROWS)
    return columns * (0.6 + 0.07 * max(map(len, names))) if names else 0.0


def _draw_scene_into_axes(
    axes: Axes3D, content: SceneContent, box: Box, view: tuple[float, float]
) -> SceneArtists:
    """Draw shadows, solids, outlines, paths and feature points into 3-D axes."""
    axes.computed_zorder = False
    axes_box.set_box_axes(axes, *box, view)
    artists = (
        shaded_solids.draw_shadows(axes, content.solids, float(box[0][2])) if view[0] > 0 else []
    )
    behind, front = _BEFORE | {"zorder": BEFORE_BEHIND}, _GOAL | {"zorder": ON_TOP}
    starts = [(wire, f"{wire.label} at start", behind) for wire in content.starts]
    goals = [(wire, f"goal of {wire.label}", front) for wire in content.goals]
    outlines = [shaded_solids.draw_solid_outline(axes, *each) for each in starts]
    artists += shaded_solids.draw_solids(axes, content.solids)
    outlines += [shaded_solids.draw_solid_outline(axes, *each) for each in goals]
    return SceneArtists(
        axes, artists, outlines, _draw_body_paths(axes, content), _draw_scene_marks(axes, content)
    )


def _draw_body_paths(axes: Axes3D, content: SceneContent) -> list[tuple[Any, Any]]:
    """Draw the path of each moving camera and object, with a dot at its end."""
    artists = []
    for (name, path), color in zip(
        content.paths.items(), _choose_path_colors(content), strict=True
    ):
        look = _PATH | {"color": color, "zorder": ON_TOP, "clip_on": False}
        (line,) = axes.plot(*path.T, **look, label=f"path of {name}")
        (dot,) = axes.plot(*path[-1:].T, **look, **_DOT)
        artists.append((line, dot))
    return artists


def _draw_scene_marks(axes: Axes3D, content: SceneContent) -> list[Any]:
    """Draw the feature points of all objects as asterisks."""
    look = _MARK | {"zorder": ON_TOP, "clip_on": False}
    pairs = zip(content.marks, content.mark_colors, strict=True)
    return [axes.plot(*mark[:, None], **look, color=color)[0] for mark, color in pairs]


def _choose_path_colors(content: SceneContent) -> list[str]:
    """Return a colour for each path, different from the colours of the solids."""
    taken = [wire.color for wire in content.solids]
    for _ in content.paths:
        taken.append(palette.find_unused_color([*taken, palette.BLACK]))
    return taken[len(content.solids) :]


def _draw_scene_legend(axes: Axes3D, content: SceneContent, place: dict[str, Any]) -> None:
    """Add the legend at a place, given as keywords of `Axes.legend`."""
    handles = _build_legend_entries(content)
    if handles:
        axes.legend(
            [handle for _, handle in handles],
            [name for name, _ in handles],
            handler_map={tuple: HandlerTuple(ndivide=None, pad=0.0)},
            frameon=False,
            **{"ncols": -(-len(handles) // ROWS)} | place,
        )


def _group_names_by_color(wires: list[WireSolid]) -> dict[str, list[str]]:
    """Return the labels of the solids by colour, each label once.

    A label with solids of several colours is listed under its most frequent colour. Colours that
    are the only colour of another label are avoided.
    """
    amounts: dict[str, dict[str, float]] = {}
    for wire in wires:
        of = amounts.setdefault(wire.label, {})
        long = float(np.linalg.norm(np.diff(wire.segments, axis=1), axis=2).sum())
        of[wire.color] = of.get(wire.color, 0.0) + long
    only = {color for of in amounts.values() if len(of) == 1 for color in of}
    names_by_color: dict[str, list[str]] = {}
    for name, of in amounts.items():
        main = max(of, key=lambda color: (color not in only, of[color]))
        names_by_color.setdefault(main, []).append(name)
    return names_by_color


def _build_legend_entries(content: SceneContent) -> list[tuple[str, Any]]:
    """Return label and artist of each entry of the legend; solids of one colour share an entry."""
    thick: dict[str, Any] = {"linewidth": 5, "solid_capstyle": "butt"}
    handles: list[tuple[str, Any]] = [
        (_abbreviate_names(names), Line2D([], [], color=palette.tint_color(color, 0.15), **thick))
        for color, names in _group_names_by_color(content.solids).items()
    ]
    if content.starts:
        handles.append(("start", Line2D([], [], **_BEFORE)))
    if content.goals:
        handles.append(("goal", Line2D([], [], **_GOAL)))
    if len(content.marks):
        some = list(dict.fromkeys(content.mark_colors))[:3]
        handles.append(("marks", tuple(Line2D([], [], **_MARK, color=color) for color in some)))
    for name, color in zip(content.paths, _choose_path_colors(content), strict=True):
        handles.append((f"path of {name}", Line2D([], [], **_PATH, **_DOT, color=color)))
    return handles


def _abbreviate_names(names: list[str]) -> str:
    """Return up to three names as text; for more names the first, the last and their number."""
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]} … {names[-1]} ({len(names)})"
