"""Figure of the image of a run: the feature points in pixels (chapter, figs 13, 14)."""

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
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, suggest_names
from robsim.geometry.pose import Pose
from robsim.plot import palette, run_data
from robsim.plot.canvas import figure_style, prepare_panels, set_axes_title
from robsim.plot.run_pictures import draw_end_picture, draw_goal_difference

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

WIDTH, IMAGE, AROUND = 5.2, 4.4, 1.4  # inches: width, height of the image and of its margins
MOST_RUNS = 50  # drawn runs of a batch; more lines are not distinguishable
MOST_NUMBERS = 12  # largest number of feature points that are numbered
MARKERS: dict[str, dict[str, Any]] = {
    "start": {"marker": palette.ASTERISK, "markersize": 9},
    "end": {"marker": "o", "markersize": 6},
    "goal": {"marker": "s", "markersize": 11, "markerfacecolor": "none", "markeredgewidth": 1.4},
    "image centre": {"marker": "+", "markersize": 9},
}
PICTURES = {"end": draw_end_picture, "difference": draw_goal_difference}
PALE = 0.75  # opacity of a picture, so that feature points stand out
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
    picture: str | None = None,
    ax: Axes | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the image of a run in pixels: the feature point paths from start to end.

    Asterisks are the start, and circles the end. Squares are the goal, with an outline around each
    target. The plus is the image centre (principal point), and the frame is the border of the
    image. Each feature point has the same colour as in `scene` and in the images of the other
    cameras. The feature points are numbered if there are at most 12. Up to 50 runs of a batch are
    drawn over each other.

    Parameters
    ----------
    run : xarray.Dataset
        A run or a batch, as `robsim.simulate` returns it.
    camera : str, optional
        Name of the camera. Default: the first camera of the run.
    scene : Scene, optional
        Scene of the run. If given, the edges of the targets of a single run are drawn, as projected
        at the start (dashed) and at the end.
    picture : {"end", "difference"}, optional
        Rendered picture under the feature points of a single run: the picture at the end, or half
        of its difference from the picture at the goal, with grey for no difference. It needs
        `scene`. Default: none.
    ax : matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches. Default: 5.2 inches wide, with a height that
        fits the image.
    title : str, optional
        Title of the axes. Default: the outcome of the run, or the number of drawn runs.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `ax`.

    Raises
    ------
    InputError
        If the run has no camera of that name; the message lists the cameras. If there is no
        picture, because there is no scene, the camera has no size, or the goal has no pose.

    Examples
    --------
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
        if picture is not None:
            _draw_picture(axes, run, camera, scene, picture)
        if ax is None and size is None:
            (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
            tall = np.clip((bottom - top) / (right - left), 0.3, 2.0)
            figure.set_size_inches(WIDTH, IMAGE * float(tall) + AROUND)
    return figure


def draw_image(
    axes: Axes, run: xr.Dataset, camera: str | None, scene: Scene | None, title: str | None
) -> None:
    """Draw the image of one camera into axes; arguments as for `image`."""
    view = run_data.select_camera_view(run_data.check_is_run(run), camera)
    tracks, description = _select_mark_paths(view)
    numbers, goal, is_single = (
        view["mark_number"].values,
        view["pixels_goal"].values,
        len(tracks) == 1,
    )
    draw_image_goal(
        axes, goal, [palette.cycle_color(number) for number in numbers], view["mark_target"].values
    )
    if scene is not None and is_single:
        _draw_target_edges(axes, view, scene)
    for track in tracks:
        _draw_mark_paths(axes, track, numbers, is_single)
    if is_single and len(goal) <= MOST_NUMBERS:
        _draw_mark_numbers(axes, tracks[0], numbers)
    pixels = np.concatenate([tracks.reshape(-1, 2), goal])
    size, centre = view.attrs["image_size"], view.attrs["image_centre"]
    set_image_axes(axes, pixels, size, centre)
    has_several = len(run_data.list_run_cameras(run)) > 1
    name = view["mark_camera"].values[0] if has_several else "image"
    set_axes_title(axes, f"{name}: {description}", title)
    unknown = {"image centre": centre is None, "goal": not np.isfinite(goal).any()}
    draw_marker_legend(axes, {name: name for name in MARKERS if not unknown.get(name, False)})


def _draw_picture(
    axes: Axes, run: xr.Dataset, camera: str | None, scene: Scene | None, which: str
) -> None:
    """Draw a picture of the camera of a run under the feature points."""
    if which not in PICTURES:
        raise InputError(f"picture: {suggest_names(which, list(PICTURES), 'pictures')}")
    if scene is None:
        raise InputError("picture: a picture needs the scene of the run, image(run, scene=...)")
    view = run_data.select_camera_view(run_data.check_is_run(run), camera)
    name = str(view["mark_camera"].values[0])
    grey = PICTURES[which](run_data.extract_single_run(view), scene, name)
    height, width = grey.shape
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    borders = axes.get_xlim(), axes.get_ylim()
    axes.imshow(grey, cmap="gray", vmin=0, vmax=255, extent=extent, zorder=0.5, alpha=PALE)
    axes.set(xlim=borders[0], ylim=borders[1])


def draw_image_goal(
    axes: Axes, goal: Array, colors: Sequence[str], targets: NDArray[np.str_]
) -> list[Artist]:
    """Draw the goals (N, 2) of the feature points as squares, and an outline around each target."""
    artists: list[Artist] = []
    for pixel, color in zip(goal, colors, strict=True):
        artists += axes.plot(*pixel, color=color, zorder=1.5, **MARKERS["goal"])
    for target in dict.fromkeys(targets.tolist()):
        own = goal[targets == target]
        rim = compute_convex_hull(own[np.isfinite(own).all(axis=1)])
        if len(rim) > 1:
            artists.append(axes.add_patch(Polygon(rim, zorder=0.9, **_OUTLINE)))
    return artists


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
    """Return the corners of one half of the hull of ordered points, without the last corner."""
    corners: list[Array] = []
    for point in ordered:
        while (
            len(corners) > 1
            and np.linalg.det([corners[-1] - corners[-2], point - corners[-1]]) <= 0
        ):
            corners.pop()
        corners.append(point)
    return corners[:-1]


def _draw_target_edges(axes: Axes, view: xr.Dataset, scene: Scene) -> None:
    """Draw the projected edges of the targets of a single run, at its start and its end."""
    camera, names = str(view["mark_camera"].values[0]), view["mark_target"].values.tolist()
    states = run_data.read_configurations(run_data.extract_single_run(view), scene)
    looks = ((states[0], {"linestyle": (0, (4, 2))}), (states[-1], {"linestyle": "-"}))
    for q, look in looks:
        for name in dict.fromkeys(names):
            for segment in project_target_edges(scene, q, camera, name):
                axes.plot(*segment.T, color=palette.GREY, linewidth=0.8, zorder=0.8, **look)


def project_target_edges(scene: Scene, q: Array, camera: str, target: str) -> Array:
    """Return the edges (E, 2, 2) of a target in pixels that are in front of the camera."""
    T = Pose(scene.pose(target, q).matrix)
    ends = [shape.at(T).vertices[shape.edges] for shape in scene.object(target).solids]
    points = np.concatenate([np.empty((0, 2, 3)), *ends])
    if not len(points):
        return np.empty((0, 2, 2))
    pixels = scene.view(q, camera, points.reshape(-1, 3)).pixels.reshape(-1, 2, 2)
    return np.asarray(pixels[np.isfinite(pixels).all(axis=(1, 2))])


def draw_marker_legend(axes: Axes, names: dict[str, str]) -> None:
    """Draw a legend below the image; `names` maps each label to its key in `MARKERS`."""
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
    """Return the pixels (runs, instants, points, 2) of the runs to draw, and their description."""
    if run.sizes.get("run", 1) == 1:
        one = run_data.extract_single_run(run)
        return one["pixels"].values[None], run_data.describe_ending(one)
    count = run.sizes["run"]
    indices = np.unique(np.linspace(0, count - 1, min(count, MOST_RUNS)).round().astype(int))
    some = run.isel(run=indices).transpose("run", "time", "mark", "axis", ...)
    return some["pixels"].values, f"{len(indices)} of {count} runs"


def _draw_mark_paths(axes: Axes, track: Array, numbers: Array, alone: bool) -> None:
    """Draw the paths (instants, points, 2) of the feature points of one run, with their ends."""
    width, scale = (1.6, 1.0) if alone else (0.5, 0.6)
    for number, path in zip(numbers, np.moveaxis(track, 1, 0), strict=True):
        color, visible = palette.cycle_color(number), path[np.isfinite(path).all(axis=1)]
        axes.plot(*path.T, color=color, linewidth=width)
        for name, pixel in (("start", visible[:1]), ("end", visible[-1:])):
            look = MARKERS[name] | {"markersize": scale * MARKERS[name]["markersize"]}
            axes.plot(*pixel.T, color=color, linestyle="none", markeredgewidth=scale, **look)


def _draw_mark_numbers(axes: Axes, track: Array, numbers: Array) -> None:
    """Write the number of each feature point, from 0, beside its start."""
    for number, path in zip(numbers, np.moveaxis(track, 1, 0), strict=True):
        visible = path[np.isfinite(path).all(axis=1)]
        if len(visible):
            back = (visible[0] - visible[-1]) * (1, -1)  # rows grow downwards, offsets upwards
            offset = 9 * back / (np.hypot(*back) or 1.0) if back.any() else (0, 9)
            axes.annotate(
                str(number),
                visible[0],
                offset,
                textcoords="offset points",
                ha="center",
                va="center",
            )


def set_image_axes(
    axes: Axes, pixels: Array, size: tuple[int, int] | None, centre: tuple[float, float] | None
) -> None:
    """Set the axes of an image: rows grow downwards, pixels are square, the border is visible.

    The axes include the points `pixels` (N, 2). `size` and `centre` are the image size and centre,
    if known.
    """
    points = pixels[np.isfinite(pixels).all(axis=1)]
    if centre is not None:
        axes.plot(*centre, color=palette.BLACK, linestyle="none", **MARKERS["image centre"])
        points = np.vstack([points, centre])
    if size is not None:
        low, high = np.full(2, -0.5), np.asarray(size) - 0.5
        points = np.clip(points, low - size, high + size)  # clips points far outside the image
        points = np.vstack([points, low, high])
        axes.add_patch(Rectangle((-0.5, -0.5), *size, facecolor="w", edgecolor="k", zorder=0))
        axes.set_facecolor(palette.FAINT)
    margin = (0.1 if size is None else 0.05) * (np.ptp(points, axis=0).max() or 1.0)
    (left, top), (right, bottom) = points.min(axis=0) - margin, points.max(axis=0) + margin
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="column (px)", ylabel="row (px)")
    axes.set_aspect("equal")
