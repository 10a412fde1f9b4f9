"""What is drawn beside the things themselves: ghosts of goal, start, belief and a second scheme."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.page.bodies import Entry, PosesOf, Stage, shape, solids
from robsim.plot import ghost, palette
from robsim.plot.moving import STILL, Moving, things
from robsim.plot.wireframe import displayed
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


def ghosts(stage: Stage, belief: Scene | None, run: xr.Dataset, depth: float) -> list[Entry]:
    """Return the outlines of the goal, of the start, and of what is elsewhere for other eyes."""
    began = solids(
        stage, stage.moving.scene, depth, "start", lambda name: _at(stage.moving.poses(name)[0])
    )
    found = goals(stage, run, depth) + [part for part in began if _moves(stage, part)]
    if belief is not None:
        believed = solids(stage, belief, depth, "belief", lambda name: _other(belief, name))
        found += [part for part in believed if _apart(stage, part)]
    if stage.moving.second is not None:
        second = solids(stage, stage.moving.second.scene, depth, "second", _second)
        found += [part for part in second if _moves(stage, part)]
    return found


def goals(stage: Stage, run: xr.Dataset, depth: float) -> list[Entry]:
    """Return the outlines of what is at its goal, which the run says."""
    scene, _ = stage.moving.spells[-1]
    return [
        {
            "frame": stage.frame(name, "goal", _at(scene.display.matrix @ T.matrix)),
            "label": f"goal of {wire.label}",
            "color": palette.GOAL,
            **shape(stage, wire),
        }
        for name, T in ghost.of_run(run).items()
        for wire in ghost.outlines(scene, name, depth)
    ]


def trails(stage: Stage) -> list[Entry]:
    """Return the frames of cameras and objects that move, whose ways are drawn."""
    colors = cycle([palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.GREEN])
    frames = [stage.frame(name) for name in things(stage.moving.scene)]
    along = [frame for frame in frames if np.ptp(stage.track(frame)[:, :3], axis=0).max() > STILL]
    return [{"frame": i, "color": color} for i, color in zip(along, colors, strict=False)]


def _at(T: Array) -> PosesOf:
    """Return how a frame stays at T (4, 4)."""
    return lambda moving: np.repeat(T[None], moving.count, axis=0)


def _other(belief: Scene, name: str) -> PosesOf:
    """Return how a frame moves in another scene."""
    return lambda moving: np.concatenate([displayed(belief, name, q) for _, q in moving.spells])


def _second(name: str) -> PosesOf:
    """Return how a frame moves under the second scheme."""

    def poses(moving: Moving) -> Array:
        assert moving.second is not None
        return moving.second.poses(name)

    return poses


def _moves(stage: Stage, part: Entry) -> bool:
    """Return whether the true frame of a part moves."""
    true = _true(stage, part)
    return true is not None and bool(np.ptp(true, axis=0).max() > STILL)


def _apart(stage: Stage, part: Entry) -> bool:
    """Return whether a part is not where the true one is."""
    true = _true(stage, part)
    return true is None or bool(np.abs(stage.track(part["frame"]) - true).max() > STILL)


def _true(stage: Stage, part: Entry) -> Array | None:
    """Return the true poses (T, 7) of the frame of a part, if there is such a frame."""
    name, _ = list(stage.frames)[part["frame"]]
    return stage.track(stage.frame(name)) if (name, "true") in stage.frames else None
