"""What is drawn beside the things themselves: ghosts of goal, start and belief, and trails."""

from __future__ import annotations

from functools import partial
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.page.bodies import Stage, shape, solids
from robsim.plot import ghost, palette
from robsim.plot.moving import STILL, Moving

if TYPE_CHECKING:
    import xarray as xr


def ghosts(
    stage: Stage, moving: Moving, belief: Moving | None, run: xr.Dataset, depth: float
) -> list[dict[str, Any]]:
    """Return the outlines of the goal, of the start, and of what is believed to be elsewhere."""
    scene, q = moving.spells[-1]
    here = np.repeat(np.eye(4)[None], len(stage.poses[0]), axis=0)
    goal = [
        {
            "frame": stage.frame("goal", "goal", lambda: here),
            "label": f"goal of {wire.label}",
            "color": palette.GOAL,
            **shape(stage, wire),
        }
        for wire in ghost.ghosts(scene, None, run, q[-1], depth)
    ]
    began = solids(stage, moving.at_start(), depth, "start")
    return [*goal, *_moved(stage, began), *_believed(stage, belief, depth)]


def _moved(stage: Stage, began: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return those parts of the start whose frames move."""
    return [part for part in began if not _still(_true(stage, part))]


def _believed(stage: Stage, belief: Moving | None, depth: float) -> list[dict[str, Any]]:
    """Return the parts of the belief that are not where the true ones are."""
    if belief is None:
        return []
    apart = []
    for part in solids(stage, belief, depth, "belief"):
        true, mine = _true(stage, part), stage.poses[part["frame"]]
        if true is None or np.abs(mine - true).max() > STILL:
            apart.append(part)
    return apart


def _true(stage: Stage, part: dict[str, Any]) -> Array | None:
    """Return the true poses (T, 7) of the frame of a part, if there is such a frame."""
    name, _ = list(stage.frames)[part["frame"]]
    number = stage.frames.get((name, "true"))
    return None if number is None else stage.poses[number]


def _still(poses: Array | None) -> bool:
    return poses is None or np.ptp(poses, axis=0).max() <= STILL


def trails(stage: Stage, moving: Moving) -> list[dict[str, Any]]:
    """Return the frames of cameras and objects that move, whose ways are drawn."""
    poses = {name: moving.poses(name) for name in moving.things}
    along = [name for name, T in poses.items() if not _still(T[:, :3, 3])]
    colors = cycle([palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.GREEN])
    frames = [stage.frame(name, "true", partial(poses.__getitem__, name)) for name in along]
    return [{"frame": i, "color": color} for i, color in zip(frames, colors, strict=False)]
