"""The 3-D part of a film: solids, shadows, feature points and paths in a fixed box."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.plot import run_data, wireframe
from robsim.plot.axes_box import compute_axes_box
from robsim.plot.film.film_source import FilmSource
from robsim.plot.goal_outlines import DrawableGoal, build_goal_outlines
from robsim.plot.scene_content import SceneContent
from robsim.plot.scene_figure import SceneArtists, arrange_scene, draw_scene, measure_scene_width
from robsim.plot.scene_motion import choose_frustum_depth
from robsim.plot.wireframe import WireSolid

MOST_SAMPLES = 50  # sampled instants at which all solids are inside the box


class FilmScene:
    """The 3-D scene of a film; frame k shows the instant `instants[k]` of the run."""

    def __init__(
        self,
        source: FilmSource,
        instants: NDArray[np.intp],
        view: tuple[float, float] | None,
        goal: DrawableGoal | None,
    ) -> None:
        self._motion, self._instants, self._view = source.motion, instants, view
        depth = choose_frustum_depth(self._motion)
        self._parts = wireframe.list_scene_parts(self._motion.scene, depth)
        self._poses: dict[str, Array] = {}
        self._paths = self._motion.paths
        self._marks = [obj for obj in self._motion.scene.objects if len(obj.marks)]
        self.content = self._build_first_content(source, goal, depth)
        some = np.unique(np.linspace(0, len(instants) - 1, MOST_SAMPLES).astype(int))
        samples = [wire.points for k in some for wire in self._place_solids(k)]
        self.box = compute_axes_box(np.concatenate([self.content.points, *samples]))
        self._artists: SceneArtists

    def measure_width(self, height: float) -> float:
        """Return the width in inches that scene and legend need at a height in inches."""
        return measure_scene_width(self.content, height, self._view, self.box)

    def draw(self, figure: Figure | SubFigure) -> list[Artist]:
        """Draw the first frame into a subfigure, and return the animated artists."""
        self._artists = draw_scene(figure, self.content, self.box, self._view)
        return self._artists.artists

    def arrange(self, figure: Figure | SubFigure) -> None:
        """Enlarge the scene to fill its subfigure, which has its final size."""
        arrange_scene(figure, self._artists.axes, self.content, self.box)

    def place(self, k: int) -> None:
        """Move all artists to frame k."""
        wires, i = self._place_solids(k), int(self._instants[k])
        for solid in self._artists.solids:
            solid.move(wires)
        for (line, dot), path in zip(self._artists.paths, self._paths.values(), strict=True):
            line.set_data_3d(*path[: i + 1].T)
            dot.set_data_3d(*path[i : i + 1].T)
        for mark, point in zip(self._artists.marks, self._place_marks(k), strict=True):
            mark.set_data_3d(*point[:, None])

    def _build_first_content(
        self, source: FilmSource, goal: DrawableGoal | None, depth: float
    ) -> SceneContent:
        """Return the content of the first frame, with the whole paths and the goal of the run."""
        motion, (scene, q) = self._motion, self._motion.phases[-1]
        first: dict[str, int] = {}
        for shot in source.shots:
            first |= run_data.number_first_marks(shot.run)
        colors = wireframe.list_mark_colors(motion.scene, first)
        run = source.shots[0].run if len(source.shots) == 1 else None
        goals = build_goal_outlines(scene, goal, run, q[-1], depth)
        return SceneContent(
            self._place_solids(0), [], self._place_marks(0), colors, self._paths, goals
        )

    def _get_frame_pose(self, frame: str, k: int) -> Array:
        """Return the pose (4, 4) of a frame of the scene in frame k of the film."""
        if frame not in self._poses:
            self._poses[frame] = self._motion.poses(frame)[self._instants]
        return np.asarray(self._poses[frame][k])

    def _place_solids(self, k: int) -> list[WireSolid]:
        """Return the solids in frame k."""
        return [
            wireframe.place_part(part, lambda name: self._get_frame_pose(name, k))
            for part in self._parts
        ]

    def _place_marks(self, k: int) -> Array:
        """Return the feature points (M, 3) of all objects in frame k."""
        points = [
            wireframe.transform_points(each.marks, self._get_frame_pose(each.name, k))
            for each in self._marks
        ]
        return np.concatenate([np.empty((0, 3)), *points])
