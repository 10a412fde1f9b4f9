"""The contents of the 3-D window, at one moment or from start to end of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import history, wireframe
from robsim.plot.ghost import ghosts
from robsim.plot.lacks import tell_lacks
from robsim.plot.moving import STILL, Moving, frustum_depth
from robsim.plot.wireframe import Wire

if TYPE_CHECKING:
    import xarray as xr

from robsim.world.scene import Scene


@dataclass(frozen=True)
class Picture:
    """The contents of a 3-D figure: solids, their outlines at the start, marks and paths."""

    solid: list[Wire]
    before: list[Wire]
    marks: Array  # (M, 3)
    mark_colors: list[str]
    paths: dict[str, Array]  # (moments, 3) of each camera and object that moves
    goal: list[Wire]

    @property
    def points(self) -> Array:
        """The points (N, 3) that must be in view; the origin if there are none."""
        wires = [wire.points for wire in (*self.solid, *self.before, *self.goal)]
        points = np.concatenate([self.marks, *self.paths.values(), *wires])
        return points if len(points) else np.zeros((1, 3))


def picture_of(scene: Scene, q: Any, run: xr.Dataset | None, goal: Any = None) -> Picture:
    """Return the picture of a scene at q (nq,), home by default, or over one run.

    `goal` is as in `ghosts`.

    InputError: q and run, or several of either; a run of another scene.
    """
    history.checked_scene(scene)
    tell_lacks(scene)
    run = None if run is None else history.single(run, timed=False)
    states = _states(scene, q, run)
    marks, moving = wireframe.marks(scene, states[-1]), Moving.of(scene, states)
    depth = frustum_depth(moving)
    solid = wireframe.wires(scene, states[-1], depth)
    pairs = zip(wireframe.wires(scene, states[0], depth), solid, strict=True)
    before = [old for old, new in pairs if np.abs(old.points - new.points).max() > STILL]
    colors = wireframe.mark_colors(scene, {} if run is None else history.first_numbers(run))
    goals = ghosts(scene, goal, run, states[-1], depth)
    return Picture(solid, before, marks, colors, moving.paths, goals)


def _states(scene: Scene, q: Any, run: xr.Dataset | None) -> Array:
    """Return the configurations (moments, nq): one, or those of a run."""
    if run is not None:
        if q is not None:
            raise InputError("give q or run, not both: a run brings its own q")
        return history.configurations(run, scene)
    now = scene.coordinates(scene.home if q is None else q, limits=False)
    if now.ndim != 1:
        raise InputError(f"q: a figure shows one configuration ({scene.nq},), got {now.shape}")
    return now[None]
