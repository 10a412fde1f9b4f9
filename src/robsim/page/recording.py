"""Recordings: what a page needs to show a run, a scene or a robot, and nothing to compute.

A recording is a header, which JSON holds, and arrays by name. `film.VERSION` counts its forms:

format, version  "robsim recording", 1
title, outcome   of the run; the outcome is a name of `robsim.Outcome`, or empty
texts            {heading: text}: how it ended, what `explain` says, the experiment as TOML
reach            lowest and highest coordinates of the origins of all frames, over all instants
frames           {name, group} of each frame; "poses" (T, frames, 7) are x, y, z, and the unit
                 quaternion x, y, z, w, in the frame of the figures
parts            solids: the number of their frame, label, colour, and the names of their arrays:
                 "triangles" (corners, 3) and "edges" (ends, 3) in axes of the frame, metres; or
                 "to", the number of the frame to which a line goes. Those of group "true" are what
                 is, of "belief" what the controller believes, of "goal" where it is to end, of
                 "start" where it began, of "second" what another scheme does
marks            points of a target: its frame, "points" (N, 3), their colours
cameras          name, frame, image size and centre, "frustum" (ends, 3) lines in camera axes,
                 "pixels" (T, N, 2) and "goal" (N, 2) of its marks, their colours; "second"
                 (T, N, 2) are the pixels under another scheme
trails           frames whose ways are drawn, with their colours
curves           title, unit, names, colours, "values" (T, n), and whether the axis is logarithmic
events           {time, text}
time             "time" (T,), seconds
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.errors import InputError, said
from robsim.engine.outcome import Outcome
from robsim.page.film import Film, Instants, Recording, belief_of
from robsim.page.told import events, joint_curves, texts
from robsim.plot import history
from robsim.plot.lacks import tell_lacks
from robsim.plot.moving import Moving
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


def recording_of(
    shown: Any, experiment: Experiment | None = None, *, trials: bool = True
) -> Recording:
    """Return the recording of a run, an experiment at its start, a scene, or a robot at home.

    What `explain` says of a run stands in it, with what it tries where `trials` are wanted.

    InputError: anything else, several runs, or a run of Python code without its experiment.
    """
    if isinstance(shown, Robot):
        return _still(Scene((shown,)), shown.name)
    if isinstance(shown, Scene):
        return _still(shown, "scene")
    if isinstance(shown, Experiment):
        q = None if shown.start is None else np.atleast_2d(shown.start)[0]
        return _still(shown.scene, shown.title or "experiment", q)
    if isinstance(shown, MissionRun):
        return _of_mission(shown)
    if hasattr(shown, "data_vars"):
        return _of_run(shown, experiment, trials)
    known = "a run, an experiment, a scene, a robot or a study"
    raise InputError(f"expected {known}, got {said(shown)}")


def _still(scene: Scene, title: str, q: Any = None) -> Recording:
    values = scene.coordinates(scene.home if q is None else q, limits=False)[None]
    moving = Moving.of(scene, values)
    tell_lacks(scene)
    return Film(moving).recording(title, Instants(np.zeros(1), moving))


def _of_run(run: xr.Dataset, experiment: Experiment | None, trials: bool) -> Recording:
    one = history.single(run)
    made = Experiment.of(run) if experiment is None else experiment
    shown = Instants.of(one, made.scene)
    tell_lacks(made.scene)
    film = Film(shown.moving, one, belief_of(made))
    outcome = Outcome(int(one["outcome"])).name
    told = {"outcome": outcome, "texts": texts(run, made, trials), "events": events(one)}
    return film.recording(made.title or "run", shown, **told)


def _of_mission(mission: MissionRun) -> Recording:
    """Return the motion of all phases; images are those of its phases alone."""
    joined, legs = mission.run, mission.legs
    moving = Moving.of_mission(mission)
    text = mission.attrs.get("scenario", "")
    begun = [{"time": leg.start, "text": leg.name} for leg in legs]
    told = {
        "outcome": legs[-1].outcome.name,
        "texts": {"mission": str(mission), "experiment": text},
        "events": [*begun, {"time": legs[-1].end, "text": _ending(mission)}],
    }
    title = Experiment.of(mission).title if text else None
    shown = Instants(joined["time"].values, moving, joint_curves(joined))
    tell_lacks(moving.scene)
    return Film(moving).recording(title or "mission", shown, **told)


def _ending(mission: MissionRun) -> str:
    """Return how many phases were done, and by when, as a title."""
    done = f"{mission.planned} phases"
    if not mission.succeeded:
        done = f"{sum(leg.succeeded for leg in mission.legs)} of {done}"
    return f"{done} done after {mission.legs[-1].end:.3g} s"
