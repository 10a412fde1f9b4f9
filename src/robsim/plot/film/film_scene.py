"""The 3-D part of a film: solids, shadows, marks and paths that move in a box that does not."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.plot import run_data, wireframe
from robsim.plot.axes_box import compute_axes_box
from robsim.plot.film.film_source import FilmSource
from robsim.plot.goal_outlines import build_goal_outlines
from robsim.plot.scene_content import SceneContent
from robsim.plot.scene_figure import SceneArtists, arrange_scene, draw_scene, measure_scene_width
from robsim.plot.scene_motion import choose_frustum_depth
from robsim.plot.wireframe import WireSolid

LOOKED_AT = 50  # instants, at the most, whose solids are to be inside of the box


class FilmScene:
    """The scene at some instants (F,) of the footage: `place` draws one of them."""

    def __init__(
        self, footage: FilmSource, instants: NDArray[np.intp], view: Any, goal: Any
    ) -> None:
        self._moving, self._instants, self._view = footage.moving, instants, view
        depth = choose_frustum_depth(self._moving)
        self._parts = wireframe.list_scene_parts(self._moving.scene, depth)
        self._poses: dict[str, Array] = {}
        self._paths = self._moving.paths
        self._marks = [thing for thing in self._moving.scene.objects if len(thing.marks)]
        self.picture = self._picture(footage, goal, depth)
        some = np.unique(np.linspace(0, len(instants) - 1, LOOKED_AT).astype(int))
        seen = [wire.points for k in some for wire in self._wires(k)]
        self.box = compute_axes_box(np.concatenate([self.picture.points, *seen]))
        self._cast: SceneArtists

    def width(self, height: float) -> float:
        """Return the width in inches that scene and legend take at a height in inches."""
        return measure_scene_width(self.picture, height, self._view, self.box)

    def draw(self, part: Any) -> list[Any]:
        """Draw the first frame into a part of a figure, and return what moves."""
        self._cast = draw_scene(part, self.picture, self.box, self._view)
        return self._cast.artists

    def arrange(self, part: Any) -> None:
        """Let it fill its part of the figure, which has its size now."""
        arrange_scene(part, self._cast.axes, self.picture, self.box)

    def place(self, k: int) -> None:
        """Move everything to where it is in frame k."""
        wires, i = self._wires(k), int(self._instants[k])
        for drawn in self._cast.solids:
            drawn.move(wires)
        for (line, dot), path in zip(self._cast.paths, self._paths.values(), strict=True):
            line.set_data_3d(*path[: i + 1].T)
            dot.set_data_3d(*path[i : i + 1].T)
        for mark, point in zip(self._cast.marks, self._marks_at(k), strict=True):
            mark.set_data_3d(*point[:, None])

    def _picture(self, footage: FilmSource, goal: Any, depth: float) -> SceneContent:
        """Return what the first frame shows, with the whole paths, and with the goal of a run."""
        moving, (scene, q) = self._moving, self._moving.spells[-1]
        first: dict[str, int] = {}
        for shot in footage.shots:
            first |= run_data.number_first_marks(shot.run)
        colors = wireframe.list_mark_colors(moving.scene, first)
        run = footage.shots[0].run if len(footage.shots) == 1 else None
        goals = build_goal_outlines(scene, goal, run, q[-1], depth)
        return SceneContent(self._wires(0), [], self._marks_at(0), colors, self._paths, goals)

    def _pose(self, frame: str, k: int) -> Array:
        """Return the pose (4, 4) of a frame of the scene in a frame of the film."""
        if frame not in self._poses:
            self._poses[frame] = self._moving.poses(frame)[self._instants]
        return np.asarray(self._poses[frame][k])

    def _wires(self, k: int) -> list[WireSolid]:
        return [
            wireframe.place_part(part, lambda name: self._pose(name, k)) for part in self._parts
        ]

    def _marks_at(self, k: int) -> Array:
        """Return the marks (M, 3) of all objects in frame k."""
        placed = [
            wireframe.transform_points(each.marks, self._pose(each.name, k)) for each in self._marks
        ]
        return np.concatenate([np.empty((0, 3)), *placed])
