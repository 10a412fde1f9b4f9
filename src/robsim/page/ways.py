"""What is drawn beside the things themselves: ghosts of goal, start and belief, and trails."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.page.bodies import Moving, Stage, shape, solids
from robsim.plot import ghost, palette
from robsim.plot.picture import STILL

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
            "frame": stage.frame("goal", "goal", here),
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
    names = {(frame["name"], frame["group"]): i for i, frame in enumerate(stage.frames)}
    found = []
    for part in began:
        true = names[stage.frames[part["frame"]]["name"], "true"]
        if np.ptp(stage.poses[true], axis=0).max() > STILL:
            found.append(part)
    return found


def _believed(stage: Stage, belief: Moving | None, depth: float) -> list[dict[str, Any]]:
    """Return the parts of the belief that are not where the true ones are."""
    if belief is None:
        return []
    parts = solids(stage, belief, depth, "belief")
    names = {(frame["name"], frame["group"]): i for i, frame in enumerate(stage.frames)}
    found = []
    for part in parts:
        true = names.get((stage.frames[part["frame"]]["name"], "true"))
        mine = stage.poses[part["frame"]]
        if true is None or np.abs(mine - stage.poses[true]).max() > STILL:
            found.append(part)
    return found


def trails(stage: Stage, moving: Moving) -> list[dict[str, Any]]:
    """Return the frames of cameras and objects that move, whose ways are drawn."""
    poses = {name: moving.poses(name) for name in moving.things}
    along = [n for n, T in poses.items() if np.ptp(T[:, :3, 3], axis=0).max() > STILL]
    colors = [palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.GREEN]
    return [
        {"frame": stage.frame(name, "true", poses[name]), "color": colors[i % len(colors)]}
        for i, name in enumerate(along)
    ]
