"""An imperfection of a run, and trial runs without it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.resimulation import StepCallback, simulate_single
from robsim.base.errors import InputError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment

TRIAL_DURATION = 3.0  # times the duration that a changed run may take
LONGEST_TRIAL = 20.0  # times the duration, if the run is known to need as much

ExperimentChange = Callable[[Experiment], Experiment]


@dataclass(frozen=True, eq=False)
class Ablation:
    """An imperfection of a run, with its numbers and the change that removes it."""

    about: str
    name: str
    sentence: str
    change: ExperimentChange
    evidence: dict[str, float] = field(default_factory=dict)
    undone: str = ""  # phrase for the run without it, such as "without latency"

    @property
    def known(self) -> dict[str, float]:
        """The finite numbers among the evidence; a user's own task may have no gain."""
        return {name: value for name, value in self.evidence.items() if math.isfinite(value)}


@dataclass(frozen=True, eq=False)
class AblationTrial:
    """How a changed run ended, and the loop that ran it."""

    outcome: Outcome
    end_time: float
    loop: Loop

    @property
    def end(self) -> str:
        """The time at which the run ended, as text."""
        return f"after {format_number(self.end_time)} s"

    @property
    def ending(self) -> str:
        """The clause for a run that converged, or that was held at its goal until the end."""
        if self.loop.hold:
            return "has converged at its end"
        return f"converges {self.end}"

    @property
    def converged(self) -> bool:
        """Whether the changed run converged."""
        return self.outcome is Outcome.CONVERGED


def run_trial(case: Experiment, see: StepCallback | None = None) -> AblationTrial | None:
    """Simulate a case and return how it ended; None if it cannot be simulated.

    `see` is called after every step.
    """
    try:
        loop = simulate_single(case, see)
    except InputError:
        return None
    seconds = float(loop.recorder.end_step[0]) * case.dt
    return AblationTrial(Outcome(int(loop.recorder.outcome[0])), seconds, loop)


def run_converging_trial(case: Experiment) -> AblationTrial | None:
    """Return the trial of a case if it converges, else None."""
    trial = run_trial(case)
    return trial if trial is not None and trial.converged else None


def simulate_outcome(case: Experiment) -> Outcome | None:
    """Return how a case ends; None if it cannot be simulated."""
    trial = run_trial(case)
    return trial.outcome if trial else None


def remove_imperfections(case: Experiment, removals: Iterable[Ablation]) -> Experiment:
    """Return the case with several imperfections removed."""
    for removal in removals:
        case = removal.change(case)
    return case


def extend_duration(case: Experiment, needed: float = 0.0) -> Experiment:
    """Return the case with three times its duration, or with as much as is needed.

    A case that is held keeps its duration.
    """
    if case.hold:
        return case
    times = max(TRIAL_DURATION, 1.2 * needed) if needed < LONGEST_TRIAL else TRIAL_DURATION
    return case.with_(duration=times * case.duration)
