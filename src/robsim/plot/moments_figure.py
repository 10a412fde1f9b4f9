"""Figure of a motion: the scene at several instants, side by side and to scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, check_known, format_value
from robsim.geometry.primitives import CameraBody, Primitive
from robsim.plot import palette, run_data
from robsim.plot.canvas import AxesLike, figure_style, parse_number_pair, prepare_panels
from robsim.plot.wireframe import compute_display_pose, list_drawable_shapes, list_scene_shapes
from robsim.world.scene import Scene

# rows: directions right, up and towards the viewer, in the frame of the figures
VIEWS = {
    "right": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "left": np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0]]),
    "behind": np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]]),
    "front": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "above": np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
}
VIEW_LABELS = {name: f"from the {name}" for name in ("right", "left", "front")} | {
    name: f"from {name}" for name in ("behind", "above")
}
PALE = 0.62  # share of white in a face that is turned to the viewer; oblique faces have less
WIDEST = 13.0  # inches
TEXT = 0.4  # inches above the pictures, for titles


class VisibleFace(NamedTuple):
    """A visible face of a solid, with corners (n, 2) in metres."""

    depth: float  # coordinate of the centre of the face, towards the viewer
    outline: Array
    edges: list[Array]  # edges of the solid that bound the face
    color: str
    pale: float


def moments(
    scene: Scene,
    q: ArrayLike,
    titles: Sequence[str] = (),
    *,
    around: str = "world",
    extent: tuple[float, float] = (1.0, 1.0),
    views: Sequence[str] = ("right",),
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the scene at several configurations side by side, in parallel projection and to scale.

    Each column is a configuration, and each row a viewing direction. The centre of a picture is the
    origin of the frame `around`. Only faces within half the width of a picture in front of this
    frame or behind it are drawn. A camera without a body is not drawn. The last picture has a scale
    bar.

    Parameters
    ----------
    scene : Scene
        Scene to draw.
    q : array_like of shape (n, nq)
        Configurations, from left to right.
    titles : sequence of n str, optional
        Titles of the columns. Default: no titles.
    around : str, default "world"
        Name of the frame at the centre of each picture.
    extent : (float, float), default (1.0, 1.0)
        Width and height of each picture in metres.
    views : sequence of {"right", "left", "behind", "front", "above"}, default ("right",)
        Viewing directions, one for each row, relative to the x axis of the frame `scene.display`.
    axes : array_like of matplotlib.axes.Axes, optional
        One axes for each picture to draw into, row by row. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches. Default: 13 inches wide.
    title : str, optional
        Title of a new figure.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If a view is unknown, or the number of titles differs from the number of configurations.

    Examples
    --------
    >>> from robsim import Robot, Scene
    >>> arm = Robot.from_dh([[0, 0, 1, 0]])
    >>> figure = moments(Scene(arm), [[0.0], [0.5]], ["before", "after"], views=["above"])
    >>> [axes.get_title() for axes in figure.axes]
    ['before', 'after']
    """
    run_data.check_is_scene(scene)
    states = as_floats(q, "q (n, nq)", (scene.nq,))
    if states.ndim != 2 or not len(states):
        raise InputError(f"q: expected shape (n, {scene.nq}), got {states.shape}")
    _check_views_and_titles(views, titles, len(states))
    width, height = _parse_extent(extent)
    with figure_style():
        rows, columns = shape = len(views), len(states)
        inches = WIDEST, rows * (WIDEST / columns) * height / width + TEXT
        figure, panels = prepare_panels(axes, rows * columns, size, inches, columns)
        grid = np.array(panels, dtype=object).reshape(shape)
        if axes is None:
            figure.suptitle(title or "")
        for row, view in zip(grid, views, strict=True):
            for panel, state in zip(row, states, strict=True):
                middle = VIEWS[view] @ compute_display_pose(scene, around, state)[:3, 3]
                _draw_faces(
                    panel, _sort_visible_faces(scene, state, VIEWS[view], middle[2], width / 2)
                )
                _set_picture_axes(panel, middle, width, height)
            row[0].set_ylabel(VIEW_LABELS[view])
        for panel, name in zip(grid[0], titles, strict=False):
            panel.set_title(name)
        _draw_scale_bar(grid[-1, -1], width, height)
    return figure


def _check_views_and_titles(views: object, titles: object, states: int) -> None:
    """Raise InputError if a view is unknown, or if the number of titles is wrong."""
    if not isinstance(views, list | tuple) or not views:
        raise InputError(f"views: expected a list, such as ['right'], got {format_value(views)}")
    for view in views:
        check_known(view, VIEWS, "no view {}", "views")
    if not isinstance(titles, list | tuple):
        raise InputError(f"titles: expected a list of texts, got {format_value(titles)}")
    if titles and len(titles) != states:
        raise InputError(
            f"titles: expected {states}, one for each configuration, got {len(titles)}"
        )


def _parse_extent(extent: ArrayLike) -> tuple[float, float]:
    """Return width and height in metres; raise InputError unless both are positive."""
    sides = parse_number_pair(extent, "extent", "(width, height) in metres")
    if min(sides) <= 0:
        raise InputError(f"extent: expected (width, height) in metres, got {format_value(extent)}")
    return sides


def _sort_visible_faces(
    scene: Scene, q: Array, view: Array, middle: float, reach: float
) -> list[VisibleFace]:
    """Return the visible faces by decreasing distance, so that nearer faces cover others."""
    faces = [
        face
        for solid, color in _place_shapes(scene, q)
        for face in _find_visible_faces(solid, color, view)
        if abs(face.depth - middle) < reach
    ]
    return sorted(faces, key=lambda face: face.depth)


def _draw_faces(axes: Axes, faces: list[VisibleFace]) -> None:
    """Draw the faces in their order."""
    for rank, face in enumerate(faces):
        color = np.array(to_rgb(face.color))
        fill = tuple(face.pale + (1 - face.pale) * color)
        body = PolyCollection([face.outline], facecolors=[fill], edgecolors=[fill], linewidths=0.2)
        lines = LineCollection(face.edges, colors=[face.color], linewidths=0.7)
        for part in (body, lines):
            part.set_zorder(2 + rank / len(faces))
            axes.add_collection(part, autolim=False)


def _find_visible_faces(solid: Primitive, color: str, view: Array) -> Iterator[VisibleFace]:
    """Yield the faces of a solid that are turned towards the viewer, and all faces of a camera."""
    skin, faces = solid.skin
    points = skin @ view.T
    borders = {tuple(sorted(edge)) for edge in solid.edges.tolist()}
    for face in faces:
        corners = points[list(face)]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        straight = float(normal[2] / np.linalg.norm(normal))
        if straight > 1e-9 or (straight < -1e-9 and isinstance(solid, CameraBody)):
            sides = zip(face, face[1:] + face[:1], strict=True)
            edges = [points[[a, b], :2] for a, b in sides if (min(a, b), max(a, b)) in borders]
            pale = PALE * (0.5 + 0.5 * abs(straight))
            yield VisibleFace(float(corners[:, 2].mean()), corners[:, :2], edges, color, pale)


def _place_shapes(scene: Scene, q: Array) -> Iterator[tuple[Primitive, str]]:
    """Yield every shape at its pose, with its colour."""
    for frame, shapes in list_scene_shapes(scene).items():
        if shapes:
            T = compute_display_pose(scene, frame, q)
            yield from (
                (shape.at(T), palette.convert_color(shape.color))
                for shape in list_drawable_shapes(shapes)
            )


def _set_picture_axes(axes: Axes, middle: Array, width: float, height: float) -> None:
    """Set the limits of a picture around its middle, without ticks."""
    half = np.array([width, height]) / 2
    (left, low), (right, high) = middle[:2] - half, middle[:2] + half
    axes.set(xlim=(left, right), ylim=(low, high), xticks=[], yticks=[], aspect="equal")
    for spine in axes.spines.values():
        spine.set_color(palette.LIGHT_GREY)


def _draw_scale_bar(axes: Axes, width: float, height: float) -> None:
    """Draw a scale bar of a round length at the lower right."""
    length = 10.0 ** np.floor(np.log10(width / 2))
    length *= max(m for m in (1, 2, 5) if m * length <= width / 2)
    right, low = axes.get_xlim()[1] - 0.05 * width, axes.get_ylim()[0] + 0.05 * height
    axes.plot([right - length, right], [low, low], color=palette.BLACK, linewidth=2, zorder=9)
    text = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
    axes.text(right - length / 2, low + 0.02 * height, text, ha="center", va="bottom", zorder=9)
