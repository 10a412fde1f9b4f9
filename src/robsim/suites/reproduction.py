"""`Reproduction`: a suite of published numbers, each of which a scenario must give again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from robsim.analysis.comparison import Comparison
from robsim.analysis.measures import MEASURES
from robsim.analysis.scheme_comparison import compare
from robsim.base.errors import Interrupted
from robsim.engine.outcome import Outcome
from robsim.engine.workers import Progress
from robsim.files import examples
from robsim.run.experiment import Experiment, load_scenario


class PublishedNumber(NamedTuple):
    """A published number: a measure of a scenario with changes, and how far it may be off."""

    scenario: str
    changes: tuple[str, ...]
    measure: str  # of `robsim.analysis.measures`, in SI units
    expected: float
    within: float

    @property
    def case(self) -> str:
        """The scenario with its changes, in a line."""
        return " ".join([self.scenario, *(each.removeprefix("task.") for each in self.changes)])

    def experiment(self) -> Experiment:
        """Return the experiment that gives the number."""
        return load_scenario(examples.path(self.scenario), self.changes)


@dataclass(frozen=True, eq=False)
class Reproduction:
    """A suite of published numbers, each with the scenario and the scheme that must give it."""

    name: str
    version: int
    title: str
    source: str
    criterion: str
    numbers: tuple[PublishedNumber, ...]


def run_reproduction(
    suite: Reproduction, how: Mapping[str, Any], progress: Progress | None
) -> pd.DataFrame:
    """Return a row for each number of a suite; Interrupted holds those before a stop."""
    experiments = {each.case: each.experiment() for each in suite.numbers}
    try:
        return _make_number_table(suite, compare(experiments, progress=progress, **how))
    except Interrupted as stop:
        raise Interrupted(str(stop), _make_number_table(suite, stop.run)) from None


def _make_number_table(suite: Reproduction, found: Comparison) -> pd.DataFrame:
    done = [each for each in suite.numbers if each.case in found.names]
    return pd.DataFrame([_make_number_row(i, suite, each, found) for i, each in enumerate(done)])


def _make_number_row(
    i: int, suite: Reproduction, number: PublishedNumber, found: Comparison
) -> dict[str, Any]:
    of_case = found.data.sel(scheme=number.case)
    value = float(of_case[number.measure])
    return {
        "suite": suite.name,
        "version": suite.version,
        "scheme": number.case,
        "run": i,
        "outcome": Outcome(int(of_case["outcome"])).words,
        "began": bool(of_case["began"]),
        "success": abs(value - number.expected) <= number.within,
        "measure": number.measure,
        "unit": MEASURES[number.measure].unit,
        "value": value,
        "expected": number.expected,
        "within": number.within,
    }
