"""A recorded run with all that is needed to repeat it, unchanged or with changes."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, RankWarning
from robsim.run.experiment import Experiment
from robsim.run.loop import Loop, OnStep
from robsim.run.outcome import Outcome
from robsim.run.replay import check_run, settings_of, whole_duration
from robsim.run.result import dataset
from robsim.run.simulate import loop_of
from robsim.run.snapshot import Snapshot
from robsim.servo.controller import Decision
from robsim.servo.tasks.task import Task
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr


ENDS = ("q_end", "outcome", "end_time")
LONGEST = 50_000  # control periods at most, as each keeps about 10 kB


@dataclass(frozen=True, eq=False)
class Case:
    """The scene, task, start and other keywords of `simulate` that make a single run."""

    scene: Scene
    task: Task
    q0: Array  # (nq,)
    settings: dict[str, Any]

    @property
    def dt(self) -> float:
        """The control period in seconds."""
        return float(self.settings["dt"])

    @property
    def sensing(self) -> Sensing:
        """The imperfections of the images."""
        return self.settings["sensing"] or Sensing()

    @property
    def actuation(self) -> Actuation:
        """The imperfections of the joints."""
        return self.settings["actuation"] or Actuation()

    def but(self, **changes: Any) -> Case:
        """Return the case with another scene, task or start, or other keywords of `simulate`."""
        own = {key: changes.pop(key) for key in ("scene", "task", "q0") if key in changes}
        return replace(self, **own, settings=self.settings | changes)

    def advanced(self, record: Any = "summary", on_step: OnStep | None = None) -> Loop:
        """Simulate the case and return the loop at its end.

        InputError or GoalError: the case cannot be simulated.
        """
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)  # the original run gave the warning
            loop = loop_of(
                self.scene, self.task, self.q0, record=record, on_step=on_step, **self.settings
            )
        loop.advance(np.arange(1), lambda share: None)
        return loop


@dataclass(frozen=True, eq=False)
class Repeated:
    """A case after its run: every recorded snapshot, and the decisions of its controller."""

    case: Case
    loop: Loop
    snapshots: list[Snapshot]  # of every step
    decisions: list[Decision]
    run: xr.Dataset
    outcome: Outcome


def case_of(
    run: xr.Dataset,
    scene: Scene | None = None,
    task: Task | None = None,
    sensing: Sensing | None = None,
    actuation: Actuation | None = None,
) -> Case:
    """Return the case of a single run, from its own text or from what is given.

    `scene` and `task`, with `sensing` and `actuation`, are needed where they are Python code.

    InputError: not a run, a batch of several runs, or a run without the text of its experiment.
    """
    check_run(run)
    one = _single(run)
    if one.sizes.get("mark") == 0:
        raise InputError("no camera has a part in this run: there is no interaction to look into")
    settings = settings_of(one)
    del settings["record"]
    outcome, seconds = _ended(one)
    if outcome is Outcome.RUNNING:
        dt = settings["dt"]
        settings["duration"] = whole_duration(seconds / dt, dt)
    if (scene is None) != (task is None):
        raise InputError("give both scene and task, or none of them")
    if scene is None or task is None:
        if sensing is not None or actuation is not None:
            raise InputError("give sensing and actuation together with scene and task")
        experiment = _own_experiment(one)
        scene, task = experiment.scene, experiment.task
        sensing, actuation = experiment.sensing, experiment.actuation
    made = {"sensing": sensing or Sensing(), "actuation": actuation or Actuation()}
    for name, value in made.items():
        if one.attrs.get(name, repr(value)) != repr(value):
            raise InputError(
                f"the run was made with {name}={one.attrs[name]}, which is not what is given: "
                f"{value!r}"
            )
    return Case(scene, task, one["q0"].values, settings | made)


def repeated(case: Case, run: xr.Dataset) -> Repeated:
    """Simulate a run again and keep every step; InputError unless it ends with the same bits."""
    one = _single(run)
    outcome, seconds = _ended(one)
    periods = round(seconds / case.dt)
    if periods > LONGEST:
        raise InputError(
            f"this run took {periods} control periods; at most {LONGEST} can be looked into"
        )
    snapshots: list[Snapshot] = []
    decisions: list[Decision] = []

    def keep(snapshot: Snapshot, decision: Decision) -> None:
        snapshots.append(snapshot)
        decisions.append(decision)

    loop = case.advanced("all", keep)
    again = dataset(loop, case.scene, case.task)
    ends = ("q_end",) if outcome is Outcome.RUNNING else ENDS
    for name in ends:
        if name in one and not np.array_equal(again[name], one[name], equal_nan=True):
            raise InputError(
                f"this run does not repeat: {name} is {again[name].values} now and was "
                f"{one[name].values}; it was made by another version, scene, task or setting "
                f"(RobSim {one.attrs.get('robsim', '?')}, kernels "
                f"{one.attrs.get('kernel_hash', '?')})"
            )
    return Repeated(case, loop, snapshots, decisions, again, outcome)


def _own_experiment(one: xr.Dataset) -> Experiment:
    try:
        return Experiment.of(one)
    except FileError:
        raise
    except InputError as reason:
        raise InputError(f"{reason}; give the scene and the task that made it") from None


def _ended(one: xr.Dataset) -> tuple[Outcome, float]:
    """Return how and when (s) a single run ended."""
    try:
        outcome, seconds = Outcome(int(one["outcome"])), float(one["end_time"])
    except KeyError:
        raise InputError("this is no run, or not all of it: no outcome and end_time") from None
    except (TypeError, ValueError) as reason:
        raise InputError(f"this is no run, or not all of it: {reason}") from None
    if not math.isfinite(seconds):
        raise InputError(f"this is no run, or not all of it: its end_time is {seconds} s")
    return outcome, seconds


def _single(run: xr.Dataset) -> xr.Dataset:
    if "q0" not in run.variables:
        raise InputError("this is no run, or not all of it: it has no 'q0'")
    count = run.sizes.get("run", 1)
    if count != 1:
        raise InputError(f"expected one run, got {count}: pick one, as in run.isel(run=0)")
    return run.squeeze("run") if "run" in run.dims else run
