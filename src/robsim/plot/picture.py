"""The contents of the 3-D window, at one moment or from start to end of a run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import history, wireframe
from robsim.plot.ghost import ghosts
from robsim.plot.lacks import tell_lacks
from robsim.plot.wireframe import Wire

if TYPE_CHECKING:
    import xarray as xr

from robsim.world.scene import Scene

FRUSTUM = 0.12  # depth of a camera without a body, as a share of the scene
STILL = 1e-6  # metres


@dataclass(frozen=True)
class Picture:
    """The contents of a 3-D figure: solids, their outlines at the start, marks and paths."""

    solid: list[Wire]
    before: list[Wire]
    marks: Array  # (M, 3)
    mark_colors: list[str]
    paths: dict[str, Array]  # (moments, 3) of each camera and object that moves
    goal: list[Wire] = field(default_factory=list)

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
    marks, ways = wireframe.marks(scene, states[-1]), _ways(scene, states)
    depth = FRUSTUM * _size([marks, *ways.values()])
    solid = wireframe.wires(scene, states[-1], depth)
    pairs = zip(wireframe.wires(scene, states[0], depth), solid, strict=True)
    before = [old for old, new in pairs if np.abs(old.points - new.points).max() > STILL]
    paths = {n: ways[n] for n in _things(scene) if np.ptp(ways[n], axis=0).max() > STILL}
    colors = wireframe.mark_colors(scene, {} if run is None else history.first_numbers(run))
    goals = ghosts(scene, goal, run, states[-1], depth)
    return Picture(solid, before, marks, colors, paths, goals)


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


def _ways(scene: Scene, states: Array) -> dict[str, Array]:
    """Return the paths (moments, 3) of the origins of all frames of the scene."""
    links = [f"{robot.name}.{link.name}" for robot in scene.robots for link in robot.links]
    frames = [*links, *_things(scene)]
    return {name: wireframe.displayed(scene, name, states)[:, :3, 3] for name in frames}


def _things(scene: Scene) -> list[str]:
    return [eye.name for eye in scene.cameras] + [thing.name for thing in scene.objects]


def _size(points: list[Array]) -> float:
    """Return the longest side in metres of the box around all points; 1 if there are none."""
    found = np.concatenate(points)
    return (float(np.ptp(found, axis=0).max()) if len(found) else 0.0) or 1.0
