"""Something that is wrong in a run, and the same run with this one thing put right."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from robsim.analysis.case import Case
from robsim.analysis.explanation.wording import number
from robsim.base.errors import InputError
from robsim.run.loop import Loop
from robsim.run.outcome import Outcome

PATIENCE = 3.0  # times its duration that a changed run may take, to see where it goes
LONGEST = 20.0  # times, where the run is known to need them

Change = Callable[[Case], Case]
Statement = tuple[str, dict[str, float]]  # a sentence and its numbers


@dataclass(frozen=True, eq=False)
class Removal:
    """What is wrong (`name`, a noun; `sentence`), in numbers, and how to put it right."""

    about: str
    name: str
    sentence: str
    change: Change
    evidence: dict[str, float] = field(default_factory=dict)
    undone: str = ""  # how the run is called in which it is right, as "without latency"

    @property
    def known(self) -> dict[str, float]:
        """The numbers that there are: a user's own kind of task may have no gain."""
        return {name: value for name, value in self.evidence.items() if math.isfinite(value)}


@dataclass(frozen=True, eq=False)
class Trial:
    """How a changed run ended, and the loop that ran it."""

    outcome: Outcome
    end_time: float
    loop: Loop

    @property
    def end(self) -> str:
        """When it ended."""
        return f"after {number(self.end_time)} s"

    @property
    def ending(self) -> str:
        """The words for one that converged; one that was held did so by its end."""
        if self.loop.hold:
            return "has converged at its end"
        return f"converges {self.end}"

    @property
    def converged(self) -> bool:
        """Whether the change is a cure."""
        return self.outcome is Outcome.CONVERGED


def tried(case: Case) -> Trial | None:
    """The end of a run; None if it makes no sense, as where its goal cannot be seen."""
    try:
        loop = case.advanced()
    except InputError:
        return None
    seconds = float(loop.recorder.end_step[0]) * case.dt
    return Trial(Outcome(int(loop.recorder.outcome[0])), seconds, loop)


def cures(case: Case) -> Trial | None:
    """The trial of a case if it converges."""
    trial = tried(case)
    return trial if trial is not None and trial.converged else None


def outcome(case: Case) -> Outcome | None:
    """How a case ends; None if it makes no sense."""
    trial = tried(case)
    return trial.outcome if trial else None


def without(case: Case, removals: Iterable[Removal]) -> Case:
    """The case with several things put right."""
    for removal in removals:
        case = removal.change(case)
    return case


def patient(case: Case, needed: float = 0.0) -> Case:
    """With three times the duration, or what is needed; one that is held ends when it ends."""
    if case.settings["hold"]:
        return case
    times = max(PATIENCE, 1.2 * needed) if needed < LONGEST else PATIENCE
    return case.but(duration=times * case.settings["duration"])


def put(part: str, **values: Any) -> Change:
    """The change of some fields of Sensing or Actuation."""
    return lambda case: case.but(**{part: replace(getattr(case, part), **values)})
