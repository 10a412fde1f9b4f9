"""The image window: the marks as the camera sees them (chapter, figs 13, 14)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.plot import palette, run_data
from robsim.plot.canvas import figure_style, prepare_panels, set_axes_title

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

WIDTH, IMAGE, AROUND = 5.2, 4.4, 1.4  # inches: figure, image, and what is above and below it
MOST_RUNS = 50  # at most of a batch, to keep lines distinguishable
MOST_NUMBERS = 12  # largest number of marks for which their numbers are drawn
MARKERS: dict[str, dict[str, Any]] = {
    "start": {"marker": palette.ASTERISK, "markersize": 9},
    "end": {"marker": "o", "markersize": 6},
    "goal": {"marker": "s", "markersize": 11, "markerfacecolor": "none", "markeredgewidth": 1.4},
    "image centre": {"marker": "+", "markersize": 9},
}
_OUTLINE: dict[str, Any] = {
    "facecolor": (*to_rgb(palette.GOAL), 0.07),
    "edgecolor": palette.GOAL,
    "linestyle": (0, (1.5, 1)),
    "linewidth": 1.2,
}


def image(
    run: xr.Dataset,
    camera: str | None = None,
    scene: Scene | None = None,
    *,
    ax: Any = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw the image of a run in pixels: mark paths from start (asterisk) to end (circle).

    Squares joined by an outline are the goal, the plus is the image centre (where the optical axis
    meets the image), the frame is the border of the image; each mark has the colour it has in
    `scene` and in the images of the other cameras. Up to 50 runs of a batch are drawn over each
    other. With the `scene`, the edges of the targets of a single run are drawn as they are seen at
    the start (dashed) and at the end. `camera` is by default the first of the run.

    ax      axes to draw into, instead of a new figure
    size    (width, height) of the figure, inches

    InputError: no camera of that name; the message lists the cameras.

    >>> from robsim import IBVS, Camera, MountedCamera, Object, Pose, Robot, Scene
    >>> from robsim.joints import Joint, Link
    >>> from robsim.run.simulate import simulate
    >>> fly = Robot("fly", [Link("base"), Link("body", "base", Joint("floating"))])
    >>> square = Object("square", marks=[[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> scene = Scene(fly, square, MountedCamera("eye", camera, "fly.body"))
    >>> figure = image(simulate(scene, IBVS(), Pose.at(0.1, 0, -0.2), duration=1.0))
    >>> figure.axes[0].get_xlabel()
    'column (px)'
    """
    with figure_style():
        figure, (axes,) = prepare_panels(ax, 1, size, (WIDTH, WIDTH))
        draw_image(axes, run, camera, scene, title)
        if ax is None and size is None:
            (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
            tall = np.clip((bottom - top) / (right - left), 0.3, 2.0)
            figure.set_size_inches(WIDTH, IMAGE * float(tall) + AROUND)
    return figure


def draw_image(
    axes: Axes, run: xr.Dataset, camera: str | None, scene: Scene | None, title: str | None
) -> None:
    """Draw the image of one camera into axes."""
    view = run_data.select_camera_view(run_data.check_is_run(run), camera)
    tracks, description = _select_mark_paths(view)
    numbers, goal, alone = view["mark_number"].values, view["pixels_goal"].values, len(tracks) == 1
    draw_image_goal(
        axes, goal, [palette.cycle_color(number) for number in numbers], view["mark_target"].values
    )
    if scene is not None and alone:
        _draw_target_edges(axes, view, scene)
    for track in tracks:
        _draw_mark_paths(axes, track, numbers, alone)
    if alone and len(goal) <= MOST_NUMBERS:
        _draw_mark_numbers(axes, tracks[0], numbers)
    seen = np.concatenate([tracks.reshape(-1, 2), goal])
    size, centre = view.attrs["image_size"], view.attrs["image_centre"]
    set_image_axes(axes, seen, size, centre)
    several = len(run_data.list_run_cameras(run)) > 1
    name = view["mark_camera"].values[0] if several else "image"
    set_axes_title(axes, f"{name}: {description}", title)
    unknown = {"image centre": centre is None, "goal": not np.isfinite(goal).any()}
    draw_marker_legend(axes, {name: name for name in MARKERS if not unknown.get(name, False)})


def draw_image_goal(axes: Axes, goal: Array, colors: Sequence[str], targets: Any) -> list[Artist]:
    """Draw the goals (N, 2) of the marks as squares, with an outline around each target."""
    drawn: list[Artist] = []
    for pixel, color in zip(goal, colors, strict=True):
        drawn += axes.plot(*pixel, color=color, zorder=1.5, **MARKERS["goal"])
    for target in dict.fromkeys(targets.tolist()):
        mine = goal[targets == target]
        rim = compute_convex_hull(mine[np.isfinite(mine).all(axis=1)])
        if len(rim) > 1:
            drawn.append(axes.add_patch(Polygon(rim, zorder=0.9, **_OUTLINE)))
    return drawn


def compute_convex_hull(points: Array) -> Array:
    """Return the corners of the convex hull of points (N, 2), in order (Andrew 1979).

    >>> compute_convex_hull(np.array([[0.0, 0], [2, 0], [1, 0.5], [2, 2], [0, 2]])).tolist()
    [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
    """
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered
    return np.array(_compute_half_hull(ordered) + _compute_half_hull(ordered[::-1]))


def _compute_half_hull(ordered: Array) -> list[Array]:
    """Return the corners of one half of the hull, without the last point."""
    hull: list[Array] = []
    for point in ordered:
        while len(hull) > 1 and np.linalg.det([hull[-1] - hull[-2], point - hull[-1]]) <= 0:
            hull.pop()
        hull.append(point)
    return hull[:-1]


def _draw_target_edges(axes: Axes, view: xr.Dataset, scene: Scene) -> None:
    """Draw the edges of the targets of a single run, as seen at its start and its end."""
    camera, names = str(view["mark_camera"].values[0]), view["mark_target"].values.tolist()
    states = run_data.read_configurations(run_data.extract_single_run(view), scene)
    looks = ((states[0], {"linestyle": (0, (4, 2))}), (states[-1], {"linestyle": "-"}))
    for q, look in looks:
        for name in dict.fromkeys(names):
            for segment in project_target_edges(scene, q, camera, name):
                axes.plot(*segment.T, color=palette.GREY, linewidth=0.8, zorder=0.8, **look)


def project_target_edges(scene: Scene, q: Array, camera: str, target: str) -> Array:
    """Return the edges (E, 2, 2) of a target in pixels that are wholly before the camera."""
    T = Pose(scene.pose(target, q).matrix)
    ends = [shape.at(T).vertices[shape.edges] for shape in scene.object(target).shapes]
    points = np.concatenate([np.empty((0, 2, 3)), *ends])
    if not len(points):
        return np.empty((0, 2, 2))
    pixels = scene.view(q, camera, points.reshape(-1, 3)).pixels.reshape(-1, 2, 2)
    return np.asarray(pixels[np.isfinite(pixels).all(axis=(1, 2))])


def draw_marker_legend(axes: Axes, names: dict[str, str]) -> None:
    """Draw a legend below the image: {name: that of its marker in `MARKERS`}."""
    look = {"color": palette.BLACK, "linestyle": "none"}
    axes.legend(
        handles=[Line2D([], [], label=n, **(look | MARKERS[kind])) for n, kind in names.items()],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.14),
        ncols=len(names),
        frameon=False,
        handletextpad=0.2,
    )


def _select_mark_paths(run: xr.Dataset) -> tuple[Array, str]:
    """Return the pixels (runs, moments, marks, 2) of some runs, and their description."""
    if run.sizes.get("run", 1) == 1:
        one = run_data.extract_single_run(run)
        return one["pixels"].values[None], run_data.describe_ending(one)
    count = run.sizes["run"]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_RUNS)).round().astype(int))
    some = run.isel(run=chosen).transpose("run", "time", "mark", "axis", ...)
    return some["pixels"].values, f"{len(chosen)} of {count} runs"


def _draw_mark_paths(axes: Axes, track: Array, numbers: Array, alone: bool) -> None:
    """Draw the paths (moments, marks, 2) of the marks of one run, with starts and ends."""
    width, scale = (1.6, 1.0) if alone else (0.5, 0.6)
    for number, way in zip(numbers, np.moveaxis(track, 1, 0), strict=True):
        color, seen = palette.cycle_color(number), way[np.isfinite(way).all(axis=1)]
        axes.plot(*way.T, color=color, linewidth=width)
        for name, pixel in (("start", seen[:1]), ("end", seen[-1:])):
            look = MARKERS[name] | {"markersize": scale * MARKERS[name]["markersize"]}
            axes.plot(*pixel.T, color=color, linestyle="none", markeredgewidth=scale, **look)


def _draw_mark_numbers(axes: Axes, track: Array, numbers: Array) -> None:
    """Write the number of each mark, from 0, beside its start."""
    for number, way in zip(numbers, np.moveaxis(track, 1, 0), strict=True):
        seen = way[np.isfinite(way).all(axis=1)]
        if len(seen):
            back = (seen[0] - seen[-1]) * (1, -1)  # rows grow downwards, points upwards
            offset = 9 * back / (np.hypot(*back) or 1.0) if back.any() else (0, 9)
            axes.annotate(
                str(number), seen[0], offset, textcoords="offset points", ha="center", va="center"
            )


def set_image_axes(axes: Axes, seen: Array, size: Any, centre: Any) -> None:
    """Set the axes of an image: rows grow downwards, pixels are square, the border is in view."""
    points = seen[np.isfinite(seen).all(axis=1)]
    if centre is not None:
        axes.plot(*centre, color=palette.BLACK, linestyle="none", **MARKERS["image centre"])
        points = np.vstack([points, centre])
    if size is not None:
        low, high = np.full(2, -0.5), np.asarray(size) - 0.5
        points = np.clip(points, low - size, high + size)  # points farther out are not shown
        points = np.vstack([points, low, high])
        axes.add_patch(Rectangle((-0.5, -0.5), *size, facecolor="w", edgecolor="k", zorder=0))
        axes.set_facecolor(palette.FAINT)
    margin = (0.1 if size is None else 0.05) * (np.ptp(points, axis=0).max() or 1.0)
    (left, top), (right, bottom) = points.min(axis=0) - margin, points.max(axis=0) + margin
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="column (px)", ylabel="row (px)")
    axes.set_aspect("equal")
