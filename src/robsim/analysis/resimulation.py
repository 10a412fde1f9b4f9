"""A recorded run that is simulated again with the state of every step."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robsim.analysis.state_history import HistoryRecorder, RunHistory, select_instants
from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, RankWarning
from robsim.engine.chunk import ChunkProgress
from robsim.engine.chunk_state import ChunkState
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run.difference import find_difference
from robsim.run.experiment import Experiment
from robsim.run.log_commands import is_log_run
from robsim.run.provenance import check_run, compute_whole_duration, read_run_settings
from robsim.run.run_checks import check_instance
from robsim.servo.command import Decision, LawInput
from robsim.servo.task_controller import TaskController
from robsim.world.actuation import Actuation
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr


LONGEST = 50_000  # most control periods; each stores about 10 kB


@dataclass(frozen=True, eq=False)
class Resimulation:
    """An experiment after its single run, with the history of states and decisions."""

    case: Experiment
    loop: Loop
    history: RunHistory
    run: xr.Dataset
    outcome: Outcome

    @property
    def controller(self) -> TaskController:
        """The controller of the run."""
        return self.loop.controller

    @property
    def q(self) -> Array:
        """The coordinates (nq, T) of all instants."""
        return self.history.state.q

    @property
    def law_inputs(self) -> LawInput | None:
        """The input of the law at all instants; None unless the run has a single servo task."""
        basis = self.history.decision.basis
        return basis if isinstance(basis, LawInput) else None

    @cached_property
    def first_state(self) -> ChunkState:
        """The state at the first instant."""
        return self.state(0)

    @cached_property
    def last_state(self) -> ChunkState:
        """The state at the last instant."""
        return self.state(-1)

    @cached_property
    def last_decision(self) -> Decision:
        """The decision at the last instant."""
        return select_instants(self.history.decision, np.array([-1]))

    def state(self, instant: int) -> ChunkState:
        """Return the state at an instant; a negative number counts from the end."""
        return select_instants(self.history.state, np.array([instant]))


def _restore_case(run: xr.Dataset, experiment: Experiment | None) -> Experiment:
    """Return the experiment of a single run, from its stored text or from `experiment`.

    `experiment` is needed if the run used Python code; start and settings come from the run. For a
    stopped run the duration ends at the stop. Raises InputError if `run` is no single run, or
    stores no experiment.
    """
    check_run(run)
    if is_log_run(run):
        raise InputError(
            "this run was recorded: use explain or replay; Experiment.of(run).run() simulates a "
            "run from the same start"
        )
    single = _get_single_run(run)
    if single.sizes.get("mark") == 0:
        raise InputError("this run uses no camera and has no interaction matrix")
    if experiment is None:
        experiment_of_run = _restore_experiment(single)
    else:
        own_experiment = check_instance(experiment, Experiment, "experiment")
        settings = read_run_settings(single)
        if own_experiment.varied:
            own_experiment = own_experiment.of_run(settings["first_run"] - own_experiment.first_run)
        experiment_of_run = own_experiment.with_(**settings)
    _check_imperfections(
        single, sensing=experiment_of_run.sensing, actuation=experiment_of_run.actuation
    )
    start = (
        experiment_of_run.scene.home if experiment_of_run.start is None else experiment_of_run.start
    )
    return experiment_of_run.with_(
        start=start, record="all", duration=_choose_duration(experiment_of_run, single)
    )


def _choose_duration(case: Experiment, one: xr.Dataset) -> float:
    """Return the duration of the experiment, or the duration until it was stopped."""
    outcome, seconds = _read_outcome(one)
    if outcome is not Outcome.RUNNING:
        return case.duration
    return compute_whole_duration(seconds / case.dt, case.dt)


def _check_imperfections(run: xr.Dataset, **imperfections: Sensing | Actuation) -> None:
    """Raise InputError if sensing or actuation of the run differ from the experiment."""
    for name, value in imperfections.items():
        if run.attrs.get(name, repr(value)) != repr(value):
            raise InputError(
                f"the run was made with {name}={run.attrs[name]}, but the experiment has {value!r}"
            )


def simulate_single(case: Experiment) -> Loop:
    """Simulate an experiment with one start and return the loop at its end.

    Raises InputError or GoalError if the simulation is impossible.
    """
    loop = _make_loop(case)
    loop.advance(ChunkProgress(np.arange(1)), lambda share: None)
    return loop


def _simulate_history(case: Experiment) -> tuple[Loop, RunHistory]:
    """Simulate an experiment with one start; return the loop at its end, and the history."""
    loop = _make_loop(case)
    recorder = HistoryRecorder(loop)
    for _, chunk in loop.instants(np.arange(1)):
        recorder.store(chunk)
    return loop, recorder.history()


def _make_loop(case: Experiment) -> Loop:
    """Return the loop of an experiment, without the warnings that the original run gave."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RankWarning)
        return case.loop()


def resimulate_run(run: xr.Dataset, experiment: Experiment | None = None) -> Resimulation:
    """Simulate a run again, store every step, and raise InputError unless the bits are the same."""
    case, single = _restore_case(run, experiment), _get_single_run(run)
    outcome, seconds = _read_outcome(single)
    periods = round(seconds / case.dt)
    if periods > LONGEST:
        raise InputError(
            f"this run took {periods} control periods; at most {LONGEST} can be simulated again"
        )
    loop, history = _simulate_history(case)
    new_run = case.dataset(loop)
    if differing := find_difference(single, new_run):
        raise InputError(f"this run is not reproduced: {differing}")
    return Resimulation(case, loop, history, new_run, outcome)


def _restore_experiment(one: xr.Dataset) -> Experiment:
    """Return the experiment that a run stores."""
    try:
        return Experiment.of(one)
    except FileError:
        raise
    except InputError as reason:
        raise InputError(f"{reason}; give the experiment of the run") from None


def _read_outcome(one: xr.Dataset) -> tuple[Outcome, float]:
    """Return the outcome and the end time (s) of a single run."""
    try:
        outcome, seconds = Outcome(int(one["outcome"])), float(one["end_time"])
    except KeyError:
        raise InputError("this is no complete run: no outcome and end_time") from None
    except (TypeError, ValueError) as reason:
        raise InputError(f"this is no complete run: {reason}") from None
    if not math.isfinite(seconds):
        raise InputError(f"this is no complete run: its end_time is {seconds} s")
    return outcome, seconds


def _get_single_run(run: xr.Dataset) -> xr.Dataset:
    """Return a run without its dimension "run"; raise InputError if it is no single run."""
    if "q0" not in run.variables:
        raise InputError("this is no complete run: it has no 'q0'")
    count = run.sizes.get("run", 1)
    if count != 1:
        raise InputError(f"expected one run, got {count}: pick one, as in run.isel(run=0)")
    return run.squeeze("run") if "run" in run.dims else run
