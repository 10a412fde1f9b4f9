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

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said
from robsim.page.bodies import Moving, Stage, solids
from robsim.page.seen import cameras, frustum_depth, marks_of
from robsim.page.told import curves, events, joint_curves, texts
from robsim.page.ways import ghosts, trails
from robsim.plot import history
from robsim.plot.lacks import tell_lacks
from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.run.outcome import Outcome
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

FORMAT, VERSION = "robsim recording", 1


@dataclass(frozen=True, eq=False)
class Recording:
    """A header and arrays by name, as this module describes them."""

    header: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


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
    raise InputError(f"expected a run, an experiment, a scene or a robot, got {said(shown)}")


def _still(scene: Scene, title: str, q: Any = None) -> Recording:
    values = scene.coordinates(scene.home if q is None else q, limits=False)[None]
    filmed = _Filmed(Moving.of(scene, values))
    return filmed.recording(title, np.zeros(1))


def _of_run(run: xr.Dataset, experiment: Experiment | None, trials: bool) -> Recording:
    one = history.single(run)
    made = Experiment.of(run) if experiment is None else experiment
    scene, q = made.scene, one["q"].values
    history.configurations(one, scene)  # a run of another scene is refused
    belief = getattr(made.task, "belief", None)
    believed = None if belief in (None, scene) else Moving.of(belief, q)
    filmed = _Filmed(Moving.of(scene, q), one)
    filmed.parts += ghosts(filmed.stage, filmed.moving, believed, one, filmed.depth)
    told = {
        "outcome": Outcome(int(one["outcome"])).name,
        "texts": texts(run, made, trials),
        "curves": curves(filmed.stage, one),
        "events": events(one),
    }
    return filmed.recording(made.title or "run", one["time"].values, **told)


def _of_mission(mission: MissionRun) -> Recording:
    """Return the motion of all phases; images are those of its phases alone."""
    joined, legs = mission.run, mission.legs
    counts = [int(sum(joined["phase"].values == leg.name)) for leg in legs]
    spells = np.split(joined["q"].values, np.cumsum(counts)[:-1])
    scenes = [leg.scene for leg in legs]
    filmed = _Filmed(Moving(tuple(zip(scenes, spells, strict=True))))
    text = mission.attrs.get("scenario", "")
    told = {
        "outcome": legs[-1].outcome.name,
        "texts": {"mission": str(mission), "experiment": text},
        "curves": joint_curves(filmed.stage, joined),
        "events": [{"time": leg.start, "text": leg.name} for leg in legs],
    }
    title = Experiment.of(mission).title if text else None
    return filmed.recording(title or "mission", joined["time"].values, **told)


class _Filmed:
    """A scene over time as the entries of a header, with the images of a run if there is one."""

    def __init__(self, moving: Moving, run: xr.Dataset | None = None) -> None:
        tell_lacks(moving.scene)
        self.moving, self.stage = moving, Stage()
        self.depth = frustum_depth(moving)
        first = {} if run is None else history.first_numbers(run)
        self.parts = solids(self.stage, moving, self.depth, "true")
        self.marks = marks_of(self.stage, moving, first)
        self.cameras = cameras(self.stage, moving, self.depth, run)
        self.trails = trails(self.stage, moving)

    def recording(self, title: str, time: Array, **told: Any) -> Recording:
        """Return the recording, with what there is to tell."""
        stage, poses = self.stage, self.stage.poses
        stage.array("time", time)
        stage.array("poses", np.stack(poses, axis=1) if poses else np.zeros((len(time), 0, 7)))
        header = {
            "format": FORMAT,
            "version": VERSION,
            "title": title,
            **{"outcome": "", "texts": {}, "curves": [], "events": [], **told},
            "frames": stage.listed,
            "parts": self.parts,
            "marks": self.marks,
            "cameras": self.cameras,
            "trails": self.trails,
        }
        return Recording(header, stage.arrays)
