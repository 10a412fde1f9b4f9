"""What matters most: how much an outcome or a measure depends on each number that was varied."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.base.text_tables import TabularValue
from robsim.engine.outcome import Outcome
from robsim.statistics.association import correlation_ratio, ranks, spearman
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import check_level
from robsim.studies import table_columns
from robsim.studies.table_columns import Among

FEWEST_RUNS = 20  # runs of which anything is told
MOST_BINS, RUNS_PER_BIN = 10, 10  # into which a number is cut, and how many runs each has at least


@dataclass(frozen=True)
class Effect:
    """How much depends on one column.

    `eta` is the correlation ratio, 0 (nothing depends on it) to 1 (everything does), whatever the
    shape: that of the groups of a choice, or of a number cut into `groups` bins of as many runs
    each. `rho` is the rank correlation of a number, -1 (falling) to 1 (rising), and NaN of a
    choice. Where eta is large and rho is not, the dependence bends.
    """

    name: str
    kind: str  # "number" or "choice"
    groups: int
    eta: Estimate
    rho: Estimate


@dataclass(frozen=True, repr=False)
class Sensitivity(TabularValue):
    """How much an outcome or a measure depends on each column, the largest first; a table.

    `of` is "converged" or the measure, `runs` how many runs count, `among` which these are, and
    `level` that of the intervals.
    """

    of: str
    among: str
    runs: int
    level: float
    effects: tuple[Effect, ...]

    def _title(self) -> str:
        return f"What matters for {self.of}"

    def _texts(self) -> list[list[str]]:
        percent = f"{100 * self.level:g} %"
        return [
            ["varied", *(each.name for each in self.effects)],
            ["kind", *(each.kind for each in self.effects)],
            [f"eta [{percent}]", *(each.eta.text("z.2f") for each in self.effects)],
            [f"rho [{percent}]", *(each.rho.text("+z.2f") for each in self.effects)],
            ["runs", *(str(each.eta.of) for each in self.effects)],
        ]

    def _numbers(self) -> list[Sequence[object]]:
        heads = [f"{name}{end}" for name in ("eta", "rho") for end in ("", "_low", "_high")]
        rows = [
            [each.name, each.kind, each.groups, *each.eta.numbers, *each.rho.numbers, each.eta.of]
            for each in self.effects
        ]
        return [["varied", "kind", "groups", *heads, "independent_runs"], *rows]

    def _notes(self) -> list[str]:
        return [
            f"{self.of}, of {self.runs} runs that {self.among}",
            "eta: how much depends on it, in any shape, 0 to 1; rho: whether it rises or falls "
            "with it, -1 to 1",
        ]


def compute_sensitivity(
    study: Any,
    of: str = "converged",
    names: Sequence[str] | str | None = None,
    *,
    among: Among | None = None,
    level: float = 0.95,
) -> Sensitivity:
    """Return how much an outcome or a measure of a study depends on each column, largest first.

    study       a study, or its table
    of          "converged" for whether a run converged, or a column of numbers
    names       columns that may matter; None: what was varied, and the start's distance and angle
                from the goal, where they differ
    among       the runs that count: "converged", or all that "began"; None: of measures those that
                converged, as a measure of a failed run says little

    Of each column the correlation ratio, which sees dependences of any shape, and of numbers the
    rank correlation of Spearman, which tells the direction (see
    `robsim.statistics.association`). Each stands for itself alone: what acts only together with
    another is not seen. Runs of the same draw are not independent: of a column that is the same for
    all of them, the draws are counted.

    InputError: a column that is not there, one value only, nothing began, or fewer than 20 runs.

    >>> import pandas as pd
    >>> rows = {"run": range(100), "draw": range(100), "task.gain": [i / 100 for i in range(100)]}
    >>> outcomes = ["CONVERGED"] * 60 + ["DIVERGED"] * 40
    >>> table = pd.DataFrame({**rows, "outcome": outcomes, "began": True})
    >>> [effect] = compute_sensitivity(table).effects
    >>> effect.name, str(effect.rho)
    ('task.gain', '-0.849 [-0.902, -0.769]')
    """
    check_level(level)
    table = table_columns.get_table(study)
    values, chosen, among = _select_values(table, of, among)
    listed = (
        table_columns.list_factors(table)
        if names is None
        else table_columns.check_column_names(names, "names")
    )
    if not listed:
        raise InputError("nothing was varied in this study: every run has the same numbers")
    known = chosen & np.isfinite(values)
    found = [
        _compute_column_effect(table, name, values, known, level) for name in listed if name != of
    ]
    order = sorted(found, key=lambda each: (-each.eta.value, each.name))
    return Sensitivity(of, among, int(known.sum()), level, tuple(order))


def _select_values(
    table: pd.DataFrame, of: str, among: Among | None
) -> tuple[Array, NDArray[np.bool_], Among]:
    """Return the values (rows,) that may depend on others, the runs that count, and which."""
    if of == "converged":
        started = table_columns.select_counted_runs(table, "began" if among is None else among)
        if among == "converged":
            raise InputError("whether runs converged is told among those that began")
        values = (table_columns.read_outcomes(table) == Outcome.CONVERGED).astype(float)
        return values, started, "began"
    chosen = among or "converged"
    return (
        table_columns.read_numbers(table, of),
        table_columns.select_counted_runs(table, chosen),
        chosen,
    )


def _compute_column_effect(
    table: pd.DataFrame, name: str, values: Array, known: NDArray[np.bool_], level: float
) -> Effect:
    """Return how much values (rows,) depend on a column, over the rows that are known."""
    number = table_columns.is_number_column(table, name)
    own = (
        table_columns.read_numbers(table, name)
        if number
        else table_columns.group_varied_column(table, name).which
    )
    known = known & (np.isfinite(own) if number else own >= 0)
    here, depends = _average_by_draw(table, own, values, known)
    _check_variation(here, depends, name)
    groups = _assign_bins(here) if number else here
    eta = correlation_ratio(groups, depends, level)
    none = Estimate(math.nan, math.nan, math.nan, len(groups))
    rho = spearman(here, depends, level) if number else none
    return Effect(name, "number" if number else "choice", len(set(groups.tolist())), eta, rho)


def _check_variation(numbers: NDArray[Any], values: Array, name: str) -> None:
    """Raise InputError for too few runs, and where there is one value only."""
    if len(values) < FEWEST_RUNS:
        raise InputError(
            f"{name}: expected {FEWEST_RUNS} runs that count, or more, got {len(values)}"
        )
    if (values == values[0]).all():
        raise InputError(
            f"all {len(values)} runs that count went alike ({values[0]:g}): nothing depends on "
            f"{name}; ask for a measure, as in of='end_time'"
        )
    if (numbers == numbers[0]).all():
        raise InputError(f"column {name!r} has one value only in the runs that count")


def _assign_bins(numbers: Array) -> NDArray[np.intp]:
    """Return the bin of each number: its value where there are few, else bins of as many each.

    Equal numbers share theirs.
    """
    values, index = np.unique(numbers, return_inverse=True)
    if len(values) <= MOST_BINS:
        return np.asarray(index, np.intp)
    n = len(numbers)
    many = max(2, min(MOST_BINS, n // RUNS_PER_BIN))
    found = np.unique(((ranks(numbers) - 0.5) / n * many).astype(np.intp), return_inverse=True)[1]
    return np.asarray(found if found.any() else numbers > numbers.min(), np.intp)


def _average_by_draw(
    table: pd.DataFrame, column: NDArray[Any], values: Array, rows: NDArray[np.bool_]
) -> tuple[NDArray[Any], Array]:
    """Return a column and the values that may depend on it, of rows that are independent.

    What all runs of a draw share is one number of the draw, and so is the mean of their values:
    what else is in turn would drown it. Else they are those of the rows.
    """
    here, depends = column[rows], values[rows]
    if not len(here):
        return here, depends
    _, draw, runs = np.unique(
        table_columns.read_draws(table, rows), return_inverse=True, return_counts=True
    )
    first = np.empty(len(runs), here.dtype)
    first[draw] = here
    if not (first[draw] == here).all():
        return here, depends
    return first, np.bincount(draw, depends) / runs
