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

from robsim.base.errors import InputError, format_value
from robsim.engine.outcome import Outcome
from robsim.page.curves_and_texts import build_joint_panels, collect_run_texts, list_run_events
from robsim.page.recording_builder import (
    Recording,
    RecordingBuilder,
    RecordingInstants,
    find_task_belief,
)
from robsim.plot import run_data
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.plot.scene_motion import SceneMotion
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


def build_recording(
    shown: Any, experiment: Experiment | None = None, *, trials: bool = True
) -> Recording:
    """Return the recording of a run, an experiment at its start, a scene, or a robot at home.

    What `explain` says of a run stands in it, with what it tries where `trials` are wanted.

    InputError: anything else, several runs, or a run of Python code without its experiment.
    """
    if isinstance(shown, Robot):
        return _record_still_scene(Scene((shown,)), shown.name)
    if isinstance(shown, Scene):
        return _record_still_scene(shown, "scene")
    if isinstance(shown, Experiment):
        q = None if shown.start is None else np.atleast_2d(shown.start)[0]
        return _record_still_scene(shown.scene, shown.title or "experiment", q)
    if isinstance(shown, MissionRun):
        return _record_mission(shown)
    if hasattr(shown, "data_vars"):
        return _record_run(shown, experiment, trials)
    known = "a run, an experiment, a scene, a robot or a study"
    raise InputError(f"expected {known}, got {format_value(shown)}")


def _record_still_scene(scene: Scene, title: str, q: Any = None) -> Recording:
    values = scene.coordinates(scene.home if q is None else q, limits=False)[None]
    moving = SceneMotion.of(scene, values)
    warn_missing_meshes(scene)
    return RecordingBuilder(moving).recording(title, RecordingInstants(np.zeros(1), moving))


def _record_run(run: xr.Dataset, experiment: Experiment | None, trials: bool) -> Recording:
    one = run_data.extract_single_run(run)
    made = Experiment.of(run) if experiment is None else experiment
    shown = RecordingInstants.of(one, made.scene)
    warn_missing_meshes(made.scene)
    film = RecordingBuilder(shown.moving, one, find_task_belief(made))
    outcome = Outcome(int(one["outcome"])).name
    told = {
        "outcome": outcome,
        "texts": collect_run_texts(run, made, trials),
        "events": list_run_events(one),
    }
    return film.recording(made.title or "run", shown, **told)


def _record_mission(mission: MissionRun) -> Recording:
    """Return the motion of all phases; images are those of its phases alone."""
    joined, legs = mission.run, mission.legs
    moving = SceneMotion.of_mission(mission)
    text = mission.attrs.get("scenario", "")
    begun = [{"time": leg.start, "text": leg.name} for leg in legs]
    told = {
        "outcome": legs[-1].outcome.name,
        "texts": {"mission": str(mission), "experiment": text},
        "events": [*begun, {"time": legs[-1].end, "text": _describe_mission_ending(mission)}],
    }
    title = Experiment.of(mission).title if text else None
    shown = RecordingInstants(joined["time"].values, moving, build_joint_panels(joined))
    warn_missing_meshes(moving.scene)
    return RecordingBuilder(moving).recording(title or "mission", shown, **told)


def _describe_mission_ending(mission: MissionRun) -> str:
    """Return how many phases were done, and by when, as a title."""
    done = f"{mission.planned} phases"
    if not mission.succeeded:
        done = f"{sum(leg.succeeded for leg in mission.legs)} of {done}"
    return f"{done} done after {mission.legs[-1].end:.3g} s"
