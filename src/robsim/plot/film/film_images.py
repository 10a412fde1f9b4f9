"""The images of a film: feature points with their paths so far, goals, and target edges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

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


def list_film_cameras(source: FilmSource) -> list[str]:
    """Return the names of the cameras that observe in the film."""
    used = (name for shot in source.shots for name in run_data.list_run_cameras(shot.run))
    return list(dict.fromkeys(used))


@dataclass
class _CameraShot:
    """The view of one camera during one run, with its artists."""

    shot: FilmShot
    view: xr.Dataset
    fixed: list[Artist] = field(default_factory=list)
    paths: list[Line2D] = field(default_factory=list)
    dots: list[Line2D] = field(default_factory=list)
    edges: list[tuple[str, LineCollection]] = field(default_factory=list)  # of each target

    @property
    def artists(self) -> list[Artist]:
        """All artists of this view."""
        return [*self.fixed, *self.paths, *self.dots, *(lines for _, lines in self.edges)]


class FilmImage:
    """The image of one camera at all instants of the film."""

    def __init__(self, source: FilmSource, camera: str, alone: bool) -> None:
        self.camera, self._alone = camera, alone
        shots = [shot for shot in source.shots if camera in run_data.list_run_cameras(shot.run)]
        self._camera_shots = [
            _CameraShot(shot, run_data.select_camera_view(shot.run, camera)) for shot in shots
        ]

    def draw(self, axes: Axes) -> list[Artist]:
        """Draw the background into axes, and return the animated artists."""
        views = [camera_shot.view for camera_shot in self._camera_shots]
        all_pixels = [view[name].values for view in views for name in ("pixels", "pixels_goal")]
        centre = views[0].attrs["image_centre"]
        points = np.concatenate([pixels.reshape(-1, 2) for pixels in all_pixels])
        set_image_axes(axes, points, views[0].attrs["image_size"], centre)
        axes.set_title("" if self._alone else self.camera)
        for camera_shot in self._camera_shots:
            _draw_camera_shot(axes, camera_shot)
        kinds = {"mark": "end", "goal": "goal", "image centre": "image centre"}
        goals = any(np.isfinite(view["pixels_goal"].values).any() for view in views)
        unknown = {"image centre": centre is None, "goal": not goals}
        draw_marker_legend(
            axes, {name: kind for name, kind in kinds.items() if not unknown.get(name, False)}
        )
        self._idle = axes.text(0.5, 0.6, "not in use", transform=axes.transAxes, **_IDLE)
        return [
            self._idle,
            *(artist for camera_shot in self._camera_shots for artist in camera_shot.artists),
        ]

    def place(self, instant: int) -> None:
        """Move the feature points to an instant; hide them while the camera is not in use."""
        self._idle.set_visible(
            all(instant not in camera_shot.shot.instants for camera_shot in self._camera_shots)
        )
        for camera_shot in self._camera_shots:
            active = instant in camera_shot.shot.instants
            for artist in camera_shot.artists:
                artist.set_visible(active)
            if active:
                _move_camera_shot(camera_shot, instant - camera_shot.shot.first, self.camera)


def _draw_camera_shot(axes: Axes, camera_shot: _CameraShot) -> None:
    """Draw the goals, and create empty artists for paths, points and edges."""
    view = camera_shot.view
    colors = [palette.cycle_color(number) for number in view["mark_number"].values]
    targets = view["mark_target"].values
    camera_shot.fixed = [*draw_image_goal(axes, view["pixels_goal"].values, colors, targets)]
    for color in colors:
        camera_shot.paths += axes.plot([], [], color=color, linewidth=1.6)
        camera_shot.dots += axes.plot([], [], color=color, linestyle="none", **MARKERS["end"])
    for target in dict.fromkeys(targets.tolist()):
        lines = LineCollection([], **_EDGES)
        axes.add_collection(lines)
        camera_shot.edges.append((target, lines))


def _move_camera_shot(camera_shot: _CameraShot, i: int, camera: str) -> None:
    """Move the artists of a view to instant i of its run."""
    pixels = camera_shot.view["pixels"].values
    for n, (path, dot) in enumerate(zip(camera_shot.paths, camera_shot.dots, strict=True)):
        path.set_data(*pixels[: i + 1, n].T)
        dot.set_data(*pixels[i : i + 1, n].T)
    q = camera_shot.view["q"].values[i]
    for target, lines in camera_shot.edges:
        lines.set_segments(list(project_target_edges(camera_shot.shot.scene, q, camera, target)))
