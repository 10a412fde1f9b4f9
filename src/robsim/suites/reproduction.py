"""`Reproduction`: a suite of published numbers that scenarios must reproduce."""

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
    """A published number: a measure of a scenario with changes, and its tolerance."""

    scenario: str
    changes: tuple[str, ...]
    measure: str  # of `robsim.analysis.measures`, in SI units
    expected: float
    within: float

    @property
    def case(self) -> str:
        """The scenario with its changes, in one line."""
        return " ".join([self.scenario, *(each.removeprefix("task.") for each in self.changes)])

    def experiment(self) -> Experiment:
        """Return the experiment that gives the number."""
        return load_scenario(examples.path(self.scenario), self.changes)


@dataclass(frozen=True, eq=False)
class Reproduction:
    """A suite of published numbers, each with its scenario and its scheme."""

    name: str
    version: int
    title: str
    source: str
    criterion: str
    numbers: tuple[PublishedNumber, ...]


def run_reproduction(
    suite: Reproduction, options: Mapping[str, Any], progress: Progress | None
) -> pd.DataFrame:
    """Return a row for each number of a suite; Interrupted carries the rows before a stop."""
    experiments = {each.case: each.experiment() for each in suite.numbers}
    try:
        return _make_number_table(suite, compare(experiments, progress=progress, **options))
    except Interrupted as stop:
        raise Interrupted(str(stop), _make_number_table(suite, stop.run)) from None


def _make_number_table(suite: Reproduction, comparison: Comparison) -> pd.DataFrame:
    """Return the rows of the finished numbers."""
    finished = [each for each in suite.numbers if each.case in comparison.names]
    return pd.DataFrame(
        [_make_number_row(i, suite, each, comparison) for i, each in enumerate(finished)]
    )


def _make_number_row(
    i: int, suite: Reproduction, number: PublishedNumber, comparison: Comparison
) -> dict[str, Any]:
    """Return the row of one number."""
    of_case = comparison.data.sel(scheme=number.case)
    value = float(of_case[number.measure])
    return {
        "suite": suite.name,
        "version": suite.version,
        "scheme": number.case,
        "run": i,
        "draw": i,
        "outcome": Outcome(int(of_case["outcome"])).words,
        "began": bool(of_case["began"]),
        "success": abs(value - number.expected) <= number.within,
        "measure": number.measure,
        "unit": MEASURES[number.measure].unit,
        "value": value,
        "expected": number.expected,
        "within": number.within,
    }
