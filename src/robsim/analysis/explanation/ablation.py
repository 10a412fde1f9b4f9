"""Removal of an imperfection from a run, and trial runs without it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.resimulation import simulate_single
from robsim.base.errors import InputError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment

TRIAL_DURATION = 3.0  # duration of a trial run, in durations of the original run
LONGEST_TRIAL = 20.0  # longest duration of a trial run with an estimated time of arrival

ExperimentChange = Callable[[Experiment], Experiment]


@dataclass(frozen=True, eq=False)
class Ablation:
    """An imperfection of a run, with its numbers and the change that removes it."""

    about: str
    name: str
    sentence: str
    change: ExperimentChange
    evidence: dict[str, float] = field(default_factory=dict)
    phrase: str = ""  # phrase for the removal, such as "without latency"

    @property
    def finite_evidence(self) -> dict[str, float]:
        """The finite numbers of the evidence; a user-defined task may have no gain."""
        return {name: value for name, value in self.evidence.items() if math.isfinite(value)}


@dataclass(frozen=True, eq=False)
class AblationTrial:
    """The result of a trial run: its outcome, its end in seconds, and its loop."""

    outcome: Outcome
    end_time: float
    loop: Loop

    @property
    def end(self) -> str:
        """The time of the end of the run, as text."""
        return f"after {format_number(self.end_time)} s"

    @property
    def clause(self) -> str:
        """The clause for a run that converged or, with hold, is at its goal at its end."""
        if self.loop.hold:
            return "ends converged"
        return f"converges {self.end}"

    @property
    def converged(self) -> bool:
        """Whether the trial run converged."""
        return self.outcome is Outcome.CONVERGED


def run_trial(case: Experiment) -> AblationTrial | None:
    """Simulate a case and return its result; None if it cannot be simulated."""
    try:
        loop = simulate_single(case)
    except InputError:
        return None
    seconds = float(loop.recorder.end_step[0]) * case.dt
    return AblationTrial(Outcome(int(loop.recorder.outcome[0])), seconds, loop)


def run_converging_trial(case: Experiment) -> AblationTrial | None:
    """Return the trial of a case if it converges, else None."""
    trial = run_trial(case)
    return trial if trial is not None and trial.converged else None


def simulate_outcome(case: Experiment) -> Outcome | None:
    """Return the outcome of a case; None if it cannot be simulated."""
    trial = run_trial(case)
    return trial.outcome if trial else None


def remove_imperfections(case: Experiment, removals: Iterable[Ablation]) -> Experiment:
    """Return the case with several imperfections removed."""
    for removal in removals:
        case = removal.change(case)
    return case


def extend_duration(case: Experiment, needed: float = 0.0) -> Experiment:
    """Return the case with a longer duration: three times, or more if `needed` is known.

    A case with hold keeps its duration.
    """
    if case.hold:
        return case
    factor = max(TRIAL_DURATION, 1.2 * needed) if needed < LONGEST_TRIAL else TRIAL_DURATION
    return case.with_(duration=factor * case.duration)
