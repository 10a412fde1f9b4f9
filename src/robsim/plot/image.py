"""The image window: the marks as the camera sees them (chapter, figs 13, 14)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from robsim.base.arrays import Array
from robsim.plot import history, palette
from robsim.plot.canvas import new_figure, style

if TYPE_CHECKING:
    import xarray as xr

WIDTH, IMAGE, AROUND = 5.2, 4.4, 1.4  # inches: figure, image, and what is above and below it
MOST_RUNS = 50  # of a batch, so that lines can be told apart
MOST_NUMBERS = 12  # of marks that are numbered
_MARKERS: dict[str, dict[str, Any]] = {
    "start": {"marker": palette.ASTERISK, "markersize": 7},
    "end": {"marker": "o", "markersize": 6, "markerfacecolor": "none"},
    "goal": {"marker": "s", "markersize": 10, "markerfacecolor": "none", "markeredgewidth": 0.8},
    "image centre": {"marker": "+", "markersize": 9},
}


def image(run: xr.Dataset, camera: str | None = None) -> Figure:
    """The image of a run, in pixels: ways of the marks from start (asterisk) to end (circle).

    Squares are the goal, the plus is the image centre (where the optical axis meets the image),
    the frame is the border of the image; each mark has the colour it has in `scene` and in the
    images of the other cameras. Of a batch, up to 50 runs are laid over each other. `camera` is by
    default the first of the run; InputError lists them where there is none of that name.

    >>> from robsim import IBVS, Camera, Joint, Link, MountedCamera, Object, Pose, Robot, Scene
    >>> from robsim.run import simulate
    >>> fly = Robot("fly", [Link("base"), Link("body", "base", Joint("floating"))])
    >>> square = Object("square", marks=[[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> scene = Scene(fly, square, MountedCamera("eye", camera, "fly.body"))
    >>> figure = image(simulate(scene, IBVS(), Pose.at(0.1, 0, -0.2), duration=1.0))
    >>> figure.axes[0].get_xlabel()
    'column (px)'
    """
    with style():
        figure = new_figure(WIDTH, WIDTH)
        axes = figure.add_subplot()
        draw(axes, run, camera)
        (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
        tall = np.clip((bottom - top) / (right - left), 0.3, 2.0)
        figure.set_size_inches(WIDTH, IMAGE * float(tall) + AROUND)
    return figure


def draw(axes: Axes, run: xr.Dataset, camera: str | None = None) -> None:
    """Draw the image of one camera into axes."""
    view = history.seen_by(history.checked(run), camera)
    tracks, title = _tracks(view)
    numbers, goal, alone = view["mark_number"].values, view["pixels_goal"].values, len(tracks) == 1
    for track in tracks:
        _draw_track(axes, track, numbers, alone)
    for number, pixel in zip(numbers, goal, strict=True):
        axes.plot(*pixel, color=palette.nth(number), zorder=1, **_MARKERS["goal"])
    if alone and len(goal) <= MOST_NUMBERS:
        _draw_numbers(axes, tracks[0], numbers)
    seen = np.concatenate([tracks.reshape(-1, 2), goal])
    size, centre = view.attrs["image_size"], view.attrs["image_centre"]
    frame(axes, seen, size, centre)
    several = len(set(run["mark_camera"].values.tolist())) > 1
    axes.set_title(f"{view['mark_camera'].values[0]}: {title}" if several else f"image: {title}")
    unknown = {"image centre": centre is None, "goal": not np.isfinite(goal).any()}
    _legend(axes, [name for name in _MARKERS if not unknown.get(name, False)])


def _legend(axes: Axes, names: list[str]) -> None:
    """What the markers mean, below the image."""
    look = {"color": palette.BLACK, "linestyle": "none"}
    axes.legend(
        handles=[Line2D([], [], label=name, **(look | _MARKERS[name])) for name in names],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.14),
        ncols=len(names),
        frameon=False,
        handletextpad=0.2,
    )


def _tracks(run: xr.Dataset) -> tuple[Array, str]:
    """(runs, moments, marks, 2) pixels of some runs, and what they are."""
    if run.sizes.get("run", 1) == 1:
        one = history.single(run)
        return one["pixels"].values[None], history.ending(one)
    count = run.sizes["run"]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_RUNS)).round().astype(int))
    some = run.isel(run=chosen).transpose("run", "time", "mark", "axis", ...)
    return some["pixels"].values, f"{len(chosen)} of {count} runs"


def _draw_track(axes: Axes, track: Array, numbers: Array, alone: bool) -> None:
    """The ways (moments, marks, 2) of the marks of one run, each with its start and its end."""
    width, scale = (1.3, 1.0) if alone else (0.5, 0.6)
    for number, way in zip(numbers, np.moveaxis(track, 1, 0), strict=True):
        color, seen = palette.nth(number), way[np.isfinite(way).all(axis=1)]
        axes.plot(*way.T, color=color, linewidth=width)
        for name, pixel in (("start", seen[:1]), ("end", seen[-1:])):
            look = _MARKERS[name] | {"markersize": scale * _MARKERS[name]["markersize"]}
            axes.plot(*pixel.T, color=color, linestyle="none", markeredgewidth=scale, **look)


def _draw_numbers(axes: Axes, track: Array, numbers: Array) -> None:
    """The number of each mark, from 0, where it starts, on the side from which it leaves."""
    for number, way in zip(numbers, np.moveaxis(track, 1, 0), strict=True):
        seen = way[np.isfinite(way).all(axis=1)]
        if len(seen):
            back = (seen[0] - seen[-1]) * (1, -1)  # rows grow downwards, points upwards
            offset = 9 * back / (np.hypot(*back) or 1.0) if back.any() else (0, 9)
            axes.annotate(
                str(number), seen[0], offset, textcoords="offset points", ha="center", va="center"
            )


def frame(axes: Axes, seen: Array, size: Any, centre: Any) -> None:
    """Rows grow downwards, pixels are square, and the border of the image is in view."""
    points = seen[np.isfinite(seen).all(axis=1)]
    if centre is not None:
        axes.plot(*centre, color=palette.BLACK, linestyle="none", **_MARKERS["image centre"])
        points = np.vstack([points, centre])
    if size is not None:
        low, high = np.full(2, -0.5), np.asarray(size) - 0.5
        points = np.clip(points, low - size, high + size)  # what is farther out is not shown
        points = np.vstack([points, low, high])
        axes.add_patch(Rectangle((-0.5, -0.5), *size, facecolor="w", edgecolor="k", zorder=0))
        axes.set_facecolor(palette.FAINT)
    margin = (0.1 if size is None else 0.05) * (np.ptp(points, axis=0).max() or 1.0)
    (left, top), (right, bottom) = points.min(axis=0) - margin, points.max(axis=0) + margin
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="column (px)", ylabel="row (px)")
    axes.set_aspect("equal")
