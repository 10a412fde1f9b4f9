"""The contents of the 3-D window, at one moment or from start to end of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import run_data, wireframe
from robsim.plot.goal_outlines import build_goal_outlines
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.plot.scene_motion import STILL, SceneMotion, choose_frustum_depth
from robsim.plot.wireframe import WireSolid

if TYPE_CHECKING:
    import xarray as xr

from robsim.world.scene import Scene


@dataclass(frozen=True)
class SceneContent:
    """The contents of a 3-D figure: solids, their outlines at the start, marks and paths."""

    solid: list[WireSolid]
    before: list[WireSolid]
    marks: Array  # (M, 3)
    mark_colors: list[str]
    paths: dict[str, Array]  # (moments, 3) of each camera and object that moves
    goal: list[WireSolid]

    @property
    def points(self) -> Array:
        """The points (N, 3) that must be in view; the origin if there are none."""
        wires = [wire.points for wire in (*self.solid, *self.before, *self.goal)]
        points = np.concatenate([self.marks, *self.paths.values(), *wires])
        return points if len(points) else np.zeros((1, 3))


def build_scene_content(
    scene: Scene, q: Any, run: xr.Dataset | None, goal: Any = None
) -> SceneContent:
    """Return the picture of a scene at q (nq,), home by default, or over one run.

    `goal` is as in `build_goal_outlines`.

    InputError: q and run, or several of either; a run of another scene.
    """
    run_data.check_is_scene(scene)
    warn_missing_meshes(scene)
    run = None if run is None else run_data.extract_single_run(run, timed=False)
    states = _select_configurations(scene, q, run)
    marks, moving = wireframe.place_scene_marks(scene, states[-1]), SceneMotion.of(scene, states)
    depth = choose_frustum_depth(moving)
    solid = wireframe.place_scene_parts(scene, states[-1], depth)
    pairs = zip(wireframe.place_scene_parts(scene, states[0], depth), solid, strict=True)
    before = [old for old, new in pairs if np.abs(old.points - new.points).max() > STILL]
    colors = wireframe.list_mark_colors(
        scene, {} if run is None else run_data.number_first_marks(run)
    )
    goals = build_goal_outlines(scene, goal, run, states[-1], depth)
    return SceneContent(solid, before, marks, colors, moving.paths, goals)


def _select_configurations(scene: Scene, q: Any, run: xr.Dataset | None) -> Array:
    """Return the configurations (moments, nq): one, or those of a run."""
    if run is not None:
        if q is not None:
            raise InputError("give q or run, not both: a run brings its own q")
        return run_data.read_configurations(run, scene)
    now = scene.coordinates(scene.home if q is None else q, limits=False)
    if now.ndim != 1:
        raise InputError(f"q: a figure shows one configuration ({scene.nq},), got {now.shape}")
    return now[None]
