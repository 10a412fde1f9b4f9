"""A recorded run that is simulated once more, with every step kept."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.errors import FileError, InputError, RankWarning
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.engine.snapshot import Snapshot
from robsim.run.checks import of_kind
from robsim.run.commanded import is_recorded
from robsim.run.difference import difference
from robsim.run.experiment import Experiment
from robsim.run.origin import check_run, made_with, whole_duration
from robsim.servo.command import Decision
from robsim.servo.controller import Controller
from robsim.world.actuation import Actuation
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr


LONGEST = 50_000  # control periods at most, as each keeps about 10 kB

See = Callable[[Snapshot, Decision], None]


@dataclass(frozen=True, eq=False)
class Repeated:
    """An experiment after its single run, with every snapshot and every decision."""

    case: Experiment
    loop: Loop
    snapshots: list[Snapshot]  # of every step
    decisions: list[Decision]
    run: xr.Dataset
    outcome: Outcome

    @property
    def controller(self) -> Controller:
        """The controller of the run."""
        return self.loop.controller


def _case(run: xr.Dataset, experiment: Experiment | None) -> Experiment:
    """Return the experiment of a single run, from its own text or from the one that is given.

    `experiment` is needed where it is Python code; start and settings are those of the run. A run
    that was stopped has the duration until then.

    InputError: not a run, a batch of several runs, or a run without the text of its experiment.
    """
    check_run(run)
    if is_recorded(run):
        raise InputError(
            "this run was recorded: explain and replay look into it; a simulated one of the same "
            "start is Experiment.of(run).run()"
        )
    one = _single(run)
    if one.sizes.get("mark") == 0:
        raise InputError("no camera has a part in this run: there is no interaction to look into")
    if experiment is None:
        made = _own_experiment(one)
    else:
        given = of_kind(experiment, Experiment, "experiment")
        own = made_with(one)
        if given.varied:
            given = given.of_run(own["first_run"] - given.first_run)
        made = given.with_(**own)
    _check_same(one, sensing=made.sensing, actuation=made.actuation)
    start = made.scene.home if made.start is None else made.start
    return made.with_(start=start, record="all", duration=_duration(made, one))


def _duration(case: Experiment, one: xr.Dataset) -> float:
    """Return the duration of the experiment, or that until it was stopped."""
    outcome, seconds = _ended(one)
    if outcome is not Outcome.RUNNING:
        return case.duration
    return whole_duration(seconds / case.dt, case.dt)


def _check_same(one: xr.Dataset, **given: Sensing | Actuation) -> None:
    for name, value in given.items():
        if one.attrs.get(name, repr(value)) != repr(value):
            raise InputError(
                f"the run was made with {name}={one.attrs[name]}, which is not what is given: "
                f"{value!r}"
            )


def advanced(case: Experiment, see: See | None = None) -> Loop:
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


def repeated(run: xr.Dataset, experiment: Experiment | None = None) -> Repeated:
    """Simulate a run again and keep every step; InputError unless it ends with the same bits."""
    case, one = _case(run, experiment), _single(run)
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

    loop = advanced(case, keep)
    again = case.dataset(loop)
    if other := difference(one, again):
        raise InputError(f"this run does not repeat: {other}")
    return Repeated(case, loop, snapshots, decisions, again, outcome)


def _own_experiment(one: xr.Dataset) -> Experiment:
    try:
        return Experiment.of(one)
    except FileError:
        raise
    except InputError as reason:
        raise InputError(f"{reason}; give the experiment that made it") from None


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
