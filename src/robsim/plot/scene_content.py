"""Content of a 3-D figure: a scene at one configuration, or from start to end of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import run_data, wireframe
from robsim.plot.goal_outlines import DrawableGoal, build_goal_outlines
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.plot.scene_motion import STILL, SceneMotion, choose_frustum_depth
from robsim.plot.wireframe import WireSolid
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class SceneContent:
    """Content of a 3-D figure: solids, their outlines at the start, feature points and paths."""

    solids: list[WireSolid]
    starts: list[WireSolid]
    marks: Array  # (M, 3)
    mark_colors: list[str]
    paths: dict[str, Array]  # (instants, 3) of each camera and object that moves
    goals: list[WireSolid]

    @property
    def points(self) -> Array:
        """The points (N, 3) that the box must contain; the origin if there are none."""
        wires = [wire.points for wire in (*self.solids, *self.starts, *self.goals)]
        points = np.concatenate([self.marks, *self.paths.values(), *wires])
        return points if len(points) else np.zeros((1, 3))


def build_scene_content(
    scene: Scene, q: ArrayLike | None, run: xr.Dataset | None, goal: DrawableGoal | None = None
) -> SceneContent:
    """Return the content of a figure of a scene at q (nq,) or over a run; by default at home.

    `goal` is the goal of `build_goal_outlines`.

    Raise InputError if both `q` and `run` are given, if either holds several configurations or
    runs, or if the run belongs to another scene.
    """
    run_data.check_is_scene(scene)
    warn_missing_meshes(scene)
    run = None if run is None else run_data.extract_single_run(run, timed=False)
    states = _select_configurations(scene, q, run)
    marks, motion = wireframe.place_scene_marks(scene, states[-1]), SceneMotion.of(scene, states)
    depth = choose_frustum_depth(motion)
    solid = wireframe.place_scene_parts(scene, states[-1], depth)
    pairs = zip(wireframe.place_scene_parts(scene, states[0], depth), solid, strict=True)
    before = [old for old, new in pairs if np.abs(old.points - new.points).max() > STILL]
    colors = wireframe.list_mark_colors(
        scene, {} if run is None else run_data.number_first_marks(run)
    )
    goals = build_goal_outlines(scene, goal, run, states[-1], depth)
    return SceneContent(solid, before, marks, colors, motion.paths, goals)


def _select_configurations(scene: Scene, q: ArrayLike | None, run: xr.Dataset | None) -> Array:
    """Return the configurations (instants, nq): one, or all of a run."""
    if run is not None:
        if q is not None:
            raise InputError("expected q or run, not both: a run has its own q")
        return run_data.read_configurations(run, scene)
    now = scene.coordinates(scene.home if q is None else q, limits=False)
    if now.ndim != 1:
        raise InputError(f"q: expected one configuration ({scene.nq},), got {now.shape}")
    return now[None]
