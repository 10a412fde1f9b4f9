"""Recordings: what a page needs to show a run, a scene or a robot, and nothing to compute.

A recording is a header, which JSON holds, and arrays by name. `VERSION` counts its forms:

format, version  "robsim recording", 1
title, outcome   of the run; the outcome is a name of `robsim.Outcome`, or empty
texts            {heading: text}: how it ended, what `explain` says, the experiment as TOML
frames           {name, group} of each frame; "poses" (T, frames, 7) are x, y, z, and the unit
                 quaternion x, y, z, w, in the frame of the figures
parts            solids: the number of their frame, label, colour, and the names of their arrays:
                 "triangles" (corners, 3) and "edges" (ends, 3) in axes of the frame, metres; or
                 "to", the number of the frame to which a line goes. Those of group "true" are what
                 is, of "belief" what the controller believes, of "goal" where it is to end, of
                 "start" where it began
marks            points of a target: its frame, "points" (N, 3), their colours
cameras          name, frame, image size and centre, "frustum" (ends, 3) lines in camera axes,
                 "pixels" (T, N, 2) and "goal" (N, 2) of its marks, their colours
trails           frames whose ways are drawn, with their colours
curves           title, unit, names, colours, "values" (T, n), and whether the axis is logarithmic
events           {time, text}
time             "time" (T,), seconds
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError
from robsim.page.bodies import Stage, solids
from robsim.page.seen import cameras, frustum_depth, marks_of
from robsim.page.told import curves, events, texts
from robsim.page.ways import ghosts, trails
from robsim.plot import history
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

FORMAT, VERSION = "robsim recording", 1


@dataclass(frozen=True, eq=False)
class Recording:
    """A header and arrays by name, as this module describes them."""

    header: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


def recording_of(shown: Any, experiment: Experiment | None = None) -> Recording:
    """Return the recording of a run, an experiment at its start, a scene, or a robot at home.

    InputError: anything else, several runs, or a run of Python code without its experiment.
    """
    if isinstance(shown, Robot):
        return _still(Scene((shown,)), shown.name)
    if isinstance(shown, Scene):
        return _still(shown, "scene")
    if isinstance(shown, Experiment):
        q = None if shown.start is None else np.atleast_2d(shown.start)[0]
        return _still(shown.scene, shown.title or "experiment", q)
    if hasattr(shown, "data_vars"):
        return _of_run(shown, experiment)
    raise InputError(f"expected a run, an experiment, a scene or a robot, got {shown!r:.80}")


def _still(scene: Scene, title: str, q: Any = None) -> Recording:
    values = scene.coordinates(scene.home if q is None else q, limits=False)[None]
    stage = Stage()
    depth = frustum_depth(scene, values)
    header = {
        "title": title,
        "outcome": "",
        "texts": {},
        "parts": solids(stage, scene, values, depth, "true"),
        "marks": marks_of(stage, scene, values, {}),
        "cameras": cameras(stage, scene, values, depth, None),
        "trails": [],
        "curves": [],
        "events": [],
    }
    return _made(stage, header, np.zeros(1))


def _of_run(run: xr.Dataset, experiment: Experiment | None) -> Recording:
    one = history.single(run)
    made = Experiment.of(run) if experiment is None else experiment
    scene, q = made.scene, one["q"].values
    history.configurations(one, scene)  # a run of another scene is refused
    stage = Stage()
    depth = frustum_depth(scene, q)
    header = {
        "title": made.title or "run",
        "outcome": _outcome(one),
        "texts": texts(run, made),
        "parts": [
            *solids(stage, scene, q, depth, "true"),
            *ghosts(stage, scene, made.task, one, depth),
        ],
        "marks": marks_of(stage, scene, q, history.first_numbers(one)),
        "cameras": cameras(stage, scene, q, depth, one),
        "trails": trails(stage, scene, q),
        "curves": curves(stage, one),
        "events": events(one),
    }
    return _made(stage, header, one["time"].values)


def _outcome(one: xr.Dataset) -> str:
    from robsim.run.outcome import Outcome

    return Outcome(int(one["outcome"])).name


def _made(stage: Stage, header: dict[str, Any], time: NDArray[Any]) -> Recording:
    stage.array("time", time)
    stage.array("poses", np.stack(stage.poses, axis=1) if stage.poses else np.zeros((1, 0, 7)))
    own = {"format": FORMAT, "version": VERSION, "frames": stage.frames}
    return Recording({**own, **header}, stage.arrays)
