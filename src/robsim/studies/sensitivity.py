"""Dependence of an outcome or a measure on each varied name of a study."""

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
from robsim.studies.table_columns import Among, StudyData

FEWEST_RUNS = 20  # least number of runs
RUNS_PER_BIN = 10  # least number of runs in each bin of a number
FEW_VALUES = 10  # a number with so few values has a bin for each value


@dataclass(frozen=True)
class Effect:
    """Dependence on one column.

    Attributes
    ----------
    name : str
        The column.
    kind : {"number", "choice"}
        Kind of the column.
    groups : int
        Number of groups of a choice, or of bins of a number.
    eta : Estimate
        Correlation ratio between 0 (no dependence) and 1 (complete dependence), of any shape. The
        bins of a number have equal numbers of runs.
    rho : Estimate
        Rank correlation of a number, -1 (falling) to 1 (rising); NaN for a choice. A large eta with
        a small rho indicates a dependence that is not monotonic.
    """

    name: str
    kind: str
    groups: int
    eta: Estimate
    rho: Estimate


@dataclass(frozen=True, repr=False)
class Sensitivity(TabularValue):
    """Dependence of an outcome or a measure on each column, largest first; printed as a table.

    Attributes
    ----------
    of : str
        "converged", or the measure.
    among : {"converged", "began"}
        Runs that count.
    runs : int
        Number of runs that count.
    level : float
        Level of the intervals.
    effects : tuple of Effect
        Dependence on each column.
    """

    of: str
    among: str
    runs: int
    level: float
    effects: tuple[Effect, ...]

    def _title(self) -> str:
        """Return the title of the table."""
        return f"Sensitivity of {self.of}"

    def _texts(self) -> list[list[str]]:
        """Return the columns as texts."""
        percent = f"{100 * self.level:g} %"
        return [
            ["varied", *(each.name for each in self.effects)],
            ["kind", *(each.kind for each in self.effects)],
            [f"eta [{percent}]", *(each.eta.text("z.2f") for each in self.effects)],
            [f"rho [{percent}]", *(each.rho.text("+z.2f") for each in self.effects)],
            ["runs", *(str(each.eta.of) for each in self.effects)],
        ]

    def _numbers(self) -> list[Sequence[object]]:
        """Return the head and the rows, in full precision."""
        heads = [f"{name}{end}" for name in ("eta", "rho") for end in ("", "_low", "_high")]
        rows = [
            [each.name, each.kind, each.groups, *each.eta.numbers, *each.rho.numbers, each.eta.of]
            for each in self.effects
        ]
        return [["varied", "kind", "groups", *heads, "independent_runs"], *rows]

    def _notes(self) -> list[str]:
        """Return the notes below the table."""
        return [
            f"{self.of}, of {self.runs} runs that {self.among}",
            "eta: dependence of any shape, 0 to 1; rho: rising or falling dependence, -1 to 1",
        ]


def compute_sensitivity(
    study: StudyData,
    of: str = "converged",
    names: Sequence[str] | str | None = None,
    *,
    among: Among | None = None,
    level: float = 0.95,
) -> Sensitivity:
    """Return the dependence of an outcome or a measure on each column of a study, largest first.

    Each column has a correlation ratio, which detects dependences of any shape. Columns of numbers
    also have Spearman's rank correlation, which shows the direction (see
    `robsim.statistics.association`). Each column is examined alone; interactions between columns
    are not detected. Runs of the same draw are not independent; for a column that is constant
    within each draw, the draws are counted.

    Parameters
    ----------
    study : StudyResult or DataFrame
        A study, or its table.
    of : str, default "converged"
        "converged" for the convergence of a run, or a column of numbers.
    names : str or sequence of str, optional
        Columns to examine. Default: the varied names, and the start's distance and angle from the
        goal.
    among : {"converged", "began"}, optional
        Runs that count. Default for measures: the converged runs, because a measure of a failed run
        has little meaning.
    level : float, default 0.95
        Level of the intervals.

    Returns
    -------
    Sensitivity
        Correlation measures of each column; printed as a table.

    Raises
    ------
    InputError
        If a column does not exist, has one value only, or fewer than 20 runs count.

    Examples
    --------
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
    effects = [
        _compute_column_effect(table, name, values, known, level) for name in listed if name != of
    ]
    order = sorted(effects, key=lambda each: (-each.eta.value, each.name))
    return Sensitivity(of, among, int(known.sum()), level, tuple(order))


def _select_values(
    table: pd.DataFrame, of: str, among: Among | None
) -> tuple[Array, NDArray[np.bool_], Among]:
    """Return the dependent values (rows,), the runs that count, and their kind."""
    if of == "converged":
        started = table_columns.select_counted_runs(table, "began" if among is None else among)
        if among == "converged":
            raise InputError("convergence is counted among the runs that began")
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
    """Return the dependence of values (rows,) on a column, over the known rows."""
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
    """Raise InputError for too few runs, or for constant values."""
    if len(values) < FEWEST_RUNS:
        raise InputError(
            f"{name}: expected {FEWEST_RUNS} runs that count, or more, got {len(values)}"
        )
    if (values == values[0]).all():
        raise InputError(
            f"all {len(values)} runs that count have the same result ({values[0]:g}), independent "
            f"of {name}; choose a measure, as in of='end_time'"
        )
    if (numbers == numbers[0]).all():
        raise InputError(f"column {name!r} has one value only in the runs that count")


def _assign_bins(numbers: Array) -> NDArray[np.intp]:
    """Return the bin of each number: its value if there are few values, else bins of equal counts.

    Equal numbers share a bin. Wide bins hide a dependence that waves, and narrow bins widen the
    interval of a number without effect. n runs have up to n / 10 bins and 2 sqrt(n) bins.
    """
    values, index = np.unique(numbers, return_inverse=True)
    n = len(numbers)
    many = max(2, min(n // RUNS_PER_BIN, 2 * math.isqrt(n)))
    if len(values) <= max(FEW_VALUES, many):
        return np.asarray(index, np.intp)
    bins = np.unique(((ranks(numbers) - 0.5) / n * many).astype(np.intp), return_inverse=True)[1]
    return np.asarray(bins if bins.any() else numbers > numbers.min(), np.intp)


def _average_by_draw(
    table: pd.DataFrame, column: NDArray[Any], values: Array, rows: NDArray[np.bool_]
) -> tuple[NDArray[Any], Array]:
    """Return a column and the dependent values of independent rows.

    If the column is constant within each draw, both are averaged over the runs of a draw. Otherwise
    the enumerated values would scatter the results and hide the effect of the column. Other columns
    keep all rows.
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
