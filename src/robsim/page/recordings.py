"""Recordings of runs, missions, scenes and robots: all data that a page shows.

A recording has a header, which is stored as JSON, and arrays by name. The version of this format is
`robsim.page.recording_builder.VERSION`. The entries of the header are:

* format, version: "robsim recording", and the number of the version.
* title, outcome: title and outcome of the run; the outcome is a name of `robsim.Outcome`, or empty.
* texts: {heading: text}, the explanation, and the experiment as TOML.
* why: what happened and how far from the goal (headline), whether the goal was missed, and the
  sentences of the explanation (findings) and of the remark in the scenario file (watch), each with
  its head, its text, and the actions that a studio offers.
* reach: lowest and highest coordinates of the origins of all frames over all instants.
* frames: {name, group} of each frame. The array "poses" (T, frames, 7) has x, y, z and the unit
  quaternion x, y, z, w relative to the frame of the figures.
* parts: solids, each with the number of its frame, label, colour, and the names of its arrays
  "triangles" (corners, 3) and "edges" (ends, 3) in metres in its frame; or "to", the number of the
  frame at the end of a line. The groups of frames are "true" (the scene), "belief" (the scene that
  the task assumes), "goal", "start" and "second" (the second scheme).
* marks: feature points of a target: its frame, "points" (N, 3), and their colours.
* cameras: name, frame, image size and centre; "frustum" (ends, 3), lines in camera axes; "pixels"
  (T, N, 2) and "goal" (N, 2) of the feature points, and their colours; "second" (T, N, 2), the
  pixels under the second scheme. "pictures", if the camera sees bodies: the "size" of its rendered
  pictures, "instants", the number of the instant of each, "images", 8-bit grey PNG files as data
  URLs, and "goal", the picture at the goal, or null; "prints", whether the scene has posters, tags,
  boards or dots. A picture is shown until the instant of the next one.
  "margins" are the distances in pixels from the border that constraints keep.
* constraints: name of each constraint of the law that acts at some instant, and the "side" of the
  image, the number of the "mark", the "target" and the "camera" that it concerns, if any; null for
  a law without constraints. The arrays "constraints holding" and "constraints yielding" (T, words)
  have a bit for each, 16 in a number: whether it holds the command back, and whether it gave way.
* trails: frames with a drawn path, of the scene and of the second scheme, and their colours.
* curves: title, unit, names, colours, "values" (T, n), and whether the axis is logarithmic. The
  torques of drives also have "limited" (T, n), 1 if the drive limited the torque in the period that
  ends at the instant.
* events: {time, text} of each event.

The array "time" (T,) has the times in seconds.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.errors import InputError, format_value
from robsim.engine.outcome import Outcome
from robsim.page.camera_pictures import PictureSource, add_pictures
from robsim.page.curves_and_texts import build_joint_panels, list_run_events
from robsim.page.explanation_card import build_card, collect_run_entries, list_remark_texts
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
    shown: xr.Dataset | MissionRun | Experiment | Scene | Robot,
    experiment: Experiment | None = None,
    *,
    trials: bool = True,
) -> Recording:
    """Return the recording of a run, a mission, an experiment at its start, a scene or a robot.

    The recording of a run contains its explanation. If `trials`, the explanation includes changes
    that `explain` tried by simulation. Raise InputError if the object has another type or several
    runs, or if `experiment` is missing and the run does not store it.
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
    expected = "a run, an experiment, a scene, a robot or a study"
    raise InputError(f"expected {expected}, got {format_value(shown)}")


def _record_still_scene(scene: Scene, title: str, q: ArrayLike | None = None) -> Recording:
    """Return the recording of a scene at one configuration."""
    values = scene.coordinates(scene.home if q is None else q, limits=False)[None]
    motion = SceneMotion.of(scene, values)
    warn_missing_meshes(scene)
    return RecordingBuilder(motion).build_recording(title, RecordingInstants(np.zeros(1), motion))


def _record_run(run: xr.Dataset, experiment: Experiment | None, trials: bool) -> Recording:
    """Return the recording of a run."""
    one = run_data.extract_single_run(run)
    source = Experiment.of(run) if experiment is None else experiment
    shown = _select_run(source, one)
    instants = _select_acting_constraints(RecordingInstants.of(one, shown.scene))
    warn_missing_meshes(shown.scene)
    builder = RecordingBuilder(instants.motion, one, find_task_belief(shown), shown.task)
    entries = collect_run_entries(run, source, trials)
    entries["why"]["watch"] = list_remark_texts(source)
    entries |= {"outcome": Outcome(int(one["outcome"])).name, "events": list_run_events(one)}
    recording = builder.build_recording(source.title or "run", instants, **entries)
    cameras = add_pictures(recording.header["cameras"], PictureSource.of(one, shown.scene))
    return replace(recording, header={**recording.header, "cameras": cameras})


def _select_acting_constraints(instants: RecordingInstants) -> RecordingInstants:
    """Return instants without the constraints that never act."""
    states = instants.constraints
    return instants if states is None else replace(instants, constraints=states.select_acting())


def _select_run(experiment: Experiment, run: xr.Dataset) -> Experiment:
    """Return the experiment of a single run, with its own numbers if they differ between runs."""
    if not experiment.varied:
        return experiment
    return experiment.of_run(int(run["run"]) - experiment.first_run)


def _record_mission(mission: MissionRun) -> Recording:
    """Return the recording of a mission: the motion of all phases, without images."""
    run, legs, ending = mission.run, mission.legs, _describe_mission_ending(mission)
    motion = SceneMotion.of_mission(mission, run)
    text = mission.attrs.get("scenario", "")
    starts = [{"time": leg.start, "text": leg.name} for leg in legs]
    entries = {
        "outcome": legs[-1].outcome.name,
        "texts": {"mission": str(mission), "experiment": text},
        "why": build_card(ending, not mission.succeeded, []),
        "events": [*starts, {"time": legs[-1].end, "text": ending}],
    }
    title = Experiment.of(mission).title if text else None
    instants = RecordingInstants(run["time"].values, motion, build_joint_panels(run))
    warn_missing_meshes(motion.scene)
    return RecordingBuilder(motion).build_recording(title or "mission", instants, **entries)


def _describe_mission_ending(mission: MissionRun) -> str:
    """Return the number of completed phases and the end time as text."""
    done = f"{mission.planned} phases"
    if not mission.succeeded:
        done = f"{sum(leg.succeeded for leg in mission.legs)} of {done}"
    return f"{done} done after {mission.legs[-1].end:.3g} s"
