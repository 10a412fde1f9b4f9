"""The images of a film: feature points with their paths so far, goals, and target edges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from robsim.plot import palette, run_data
from robsim.plot.film.film_source import FilmShot, FilmSource
from robsim.plot.image_figure import (
    MARKERS,
    draw_image_goal,
    draw_marker_legend,
    project_target_edges,
    set_image_axes,
)

if TYPE_CHECKING:
    import xarray as xr

_EDGES: dict[str, Any] = {"colors": palette.GREY, "linewidths": 0.8, "zorder": 0.8}
_IDLE: dict[str, Any] = {"color": palette.GREY, "ha": "center", "va": "center"}


def list_film_cameras(footage: FilmSource) -> list[str]:
    """Return the names of the cameras that observe in the film."""
    used = (name for shot in footage.shots for name in run_data.list_run_cameras(shot.run))
    return list(dict.fromkeys(used))


@dataclass
class _CameraShot:
    """The view of one camera during one run, with its artists."""

    shot: FilmShot
    view: xr.Dataset
    fixed: list[Any] = field(default_factory=list)
    paths: list[Any] = field(default_factory=list)
    dots: list[Any] = field(default_factory=list)
    edges: list[tuple[str, Any]] = field(default_factory=list)  # of each target

    @property
    def artists(self) -> list[Any]:
        """All artists of this view."""
        return [*self.fixed, *self.paths, *self.dots, *(lines for _, lines in self.edges)]


class FilmImage:
    """The image of one camera at all instants of the film."""

    def __init__(self, footage: FilmSource, camera: str, alone: bool) -> None:
        self.camera, self._alone = camera, alone
        shots = [shot for shot in footage.shots if camera in run_data.list_run_cameras(shot.run)]
        self._takes = [
            _CameraShot(shot, run_data.select_camera_view(shot.run, camera)) for shot in shots
        ]

    def draw(self, axes: Axes) -> list[Any]:
        """Draw the background into axes, and return the animated artists."""
        views = [take.view for take in self._takes]
        all_pixels = [view[name].values for view in views for name in ("pixels", "pixels_goal")]
        centre = views[0].attrs["image_centre"]
        points = np.concatenate([pixels.reshape(-1, 2) for pixels in all_pixels])
        set_image_axes(axes, points, views[0].attrs["image_size"], centre)
        axes.set_title("" if self._alone else self.camera)
        for take in self._takes:
            _draw_camera_shot(axes, take)
        kinds = {"mark": "end", "goal": "goal", "image centre": "image centre"}
        goals = any(np.isfinite(view["pixels_goal"].values).any() for view in views)
        unknown = {"image centre": centre is None, "goal": not goals}
        draw_marker_legend(
            axes, {name: kind for name, kind in kinds.items() if not unknown.get(name, False)}
        )
        self._idle = axes.text(0.5, 0.6, "not in use", transform=axes.transAxes, **_IDLE)
        return [self._idle, *(artist for take in self._takes for artist in take.artists)]

    def place(self, instant: int) -> None:
        """Move the feature points to an instant; hide them while the camera is not in use."""
        self._idle.set_visible(all(instant not in take.shot.instants for take in self._takes))
        for take in self._takes:
            active = instant in take.shot.instants
            for artist in take.artists:
                artist.set_visible(active)
            if active:
                _move_camera_shot(take, instant - take.shot.first, self.camera)


def _draw_camera_shot(axes: Axes, take: _CameraShot) -> None:
    """Draw the goals, and create empty artists for paths, points and edges."""
    view = take.view
    colors = [palette.cycle_color(number) for number in view["mark_number"].values]
    targets = view["mark_target"].values
    take.fixed = [*draw_image_goal(axes, view["pixels_goal"].values, colors, targets)]
    for color in colors:
        take.paths += axes.plot([], [], color=color, linewidth=1.6)
        take.dots += axes.plot([], [], color=color, linestyle="none", **MARKERS["end"])
    for target in dict.fromkeys(targets.tolist()):
        take.edges.append((target, axes.add_collection(LineCollection([], **_EDGES))))


def _move_camera_shot(take: _CameraShot, i: int, camera: str) -> None:
    """Move the artists of a view to instant i of its run."""
    pixels = take.view["pixels"].values
    for n, (path, dot) in enumerate(zip(take.paths, take.dots, strict=True)):
        path.set_data(*pixels[: i + 1, n].T)
        dot.set_data(*pixels[i : i + 1, n].T)
    q = take.view["q"].values[i]
    for target, lines in take.edges:
        lines.set_segments(list(project_target_edges(take.shot.scene, q, camera, target)))
