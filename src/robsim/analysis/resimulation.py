"""A recorded run that is simulated once more, with every step kept."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.errors import FileError, InputError, RankWarning
from robsim.engine.chunk_state import ChunkState
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run.difference import find_difference
from robsim.run.experiment import Experiment
from robsim.run.log_commands import is_log_run
from robsim.run.provenance import check_run, compute_whole_duration, read_run_settings
from robsim.run.run_checks import check_instance
from robsim.servo.command import Decision
from robsim.servo.task_controller import TaskController
from robsim.world.actuation import Actuation
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr


LONGEST = 50_000  # control periods at most, as each keeps about 10 kB

StepCallback = Callable[[ChunkState, Decision], None]


@dataclass(frozen=True, eq=False)
class Resimulation:
    """An experiment after its single run, with every snapshot and every decision."""

    case: Experiment
    loop: Loop
    snapshots: list[ChunkState]  # of every step
    decisions: list[Decision]
    run: xr.Dataset
    outcome: Outcome

    @property
    def controller(self) -> TaskController:
        """The controller of the run."""
        return self.loop.controller


def _restore_case(run: xr.Dataset, experiment: Experiment | None) -> Experiment:
    """Return the experiment of a single run, from its own text or from the one that is given.

    `experiment` is needed where it is Python code; start and settings are those of the run. A run
    that was stopped has the duration until then.

    InputError: not a run, a batch of several runs, or a run without the text of its experiment.
    """
    check_run(run)
    if is_log_run(run):
        raise InputError(
            "this run was recorded: explain and replay look into it; a simulated one of the same "
            "start is Experiment.of(run).run()"
        )
    one = _get_single_run(run)
    if one.sizes.get("mark") == 0:
        raise InputError("no camera has a part in this run: there is no interaction to look into")
    if experiment is None:
        made = _restore_experiment(one)
    else:
        given = check_instance(experiment, Experiment, "experiment")
        own = read_run_settings(one)
        if given.varied:
            given = given.of_run(own["first_run"] - given.first_run)
        made = given.with_(**own)
    _check_imperfections(one, sensing=made.sensing, actuation=made.actuation)
    start = made.scene.home if made.start is None else made.start
    return made.with_(start=start, record="all", duration=_choose_duration(made, one))


def _choose_duration(case: Experiment, one: xr.Dataset) -> float:
    """Return the duration of the experiment, or that until it was stopped."""
    outcome, seconds = _read_outcome(one)
    if outcome is not Outcome.RUNNING:
        return case.duration
    return compute_whole_duration(seconds / case.dt, case.dt)


def _check_imperfections(one: xr.Dataset, **given: Sensing | Actuation) -> None:
    for name, value in given.items():
        if one.attrs.get(name, repr(value)) != repr(value):
            raise InputError(
                f"the run was made with {name}={one.attrs[name]}, which is not what is given: "
                f"{value!r}"
            )


def simulate_single(case: Experiment, see: StepCallback | None = None) -> Loop:
    """Simulate an experiment of one start and return the loop at its end.

    `see` is called after every step.

    InputError or GoalError: it cannot be simulated.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)  # the original run gave the warning
        loop = case.loop()
    for _, chunk in loop.instants(np.arange(1)):
        if see:
            see(loop.sequence.snapshot(chunk), loop.sequence.decision(chunk))
    return loop


def resimulate_run(run: xr.Dataset, experiment: Experiment | None = None) -> Resimulation:
    """Simulate a run again and keep every step; InputError unless it ends with the same bits."""
    case, one = _restore_case(run, experiment), _get_single_run(run)
    outcome, seconds = _read_outcome(one)
    periods = round(seconds / case.dt)
    if periods > LONGEST:
        raise InputError(
            f"this run took {periods} control periods; at most {LONGEST} can be looked into"
        )
    snapshots: list[ChunkState] = []
    decisions: list[Decision] = []

    def keep(snapshot: ChunkState, decision: Decision) -> None:
        snapshots.append(snapshot)
        decisions.append(decision)

    loop = simulate_single(case, keep)
    again = case.dataset(loop)
    if other := find_difference(one, again):
        raise InputError(f"this run does not repeat: {other}")
    return Resimulation(case, loop, snapshots, decisions, again, outcome)


def _restore_experiment(one: xr.Dataset) -> Experiment:
    try:
        return Experiment.of(one)
    except FileError:
        raise
    except InputError as reason:
        raise InputError(f"{reason}; give the experiment that made it") from None


def _read_outcome(one: xr.Dataset) -> tuple[Outcome, float]:
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


def _get_single_run(run: xr.Dataset) -> xr.Dataset:
    if "q0" not in run.variables:
        raise InputError("this is no run, or not all of it: it has no 'q0'")
    count = run.sizes.get("run", 1)
    if count != 1:
        raise InputError(f"expected one run, got {count}: pick one, as in run.isel(run=0)")
    return run.squeeze("run") if "run" in run.dims else run
