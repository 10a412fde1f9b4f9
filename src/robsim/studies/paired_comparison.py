"""Comparison of schemes on the same draws: success rates, and a measure if both succeed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.base.text_tables import TabularValue
from robsim.engine.outcome import Outcome
from robsim.statistics.estimate import Estimate
from robsim.statistics.paired_tests import mcnemar, median_interval, paired_difference
from robsim.statistics.proportions import check_level
from robsim.studies import table_columns
from robsim.studies.table_columns import StudyData

MOST_COMPARED = 20  # values, with 190 pairs


class PairCounts(NamedTuple):
    """Numbers of draws by the outcomes of two runs.

    Among the draws with two runs that could begin, `both`, `only_first`, `only_second` and
    `neither` count the draws by the runs that converged. `apart` counts draws with a run that could
    not begin, and `missing` draws that lack one of the two runs.
    """

    both: int
    only_first: int
    only_second: int
    neither: int
    apart: int
    missing: int


@dataclass(frozen=True)
class Pair:
    """Two values of the compared column, such as two tasks, on the same draws.

    Attributes
    ----------
    first, second : str
        The two values.
    counts : PairCounts
        Numbers of draws by outcome.
    p : float
        p-value of McNemar's exact test on the draws with exactly one converged run.
    p_holm : float
        The same p-value, corrected for the number of pairs.
    difference : Estimate
        Converged share of the first value minus the share of the second.
    median : Estimate
        Median of the differences (first minus second) of a measure, over draws with both converged.
    """

    first: str
    second: str
    counts: PairCounts
    p: float
    p_holm: float
    difference: Estimate
    median: Estimate


@dataclass(frozen=True, repr=False)
class PairedComparison(TabularValue):
    """Pairs of values of a column, compared on the same draws; printed as a table.

    Attributes
    ----------
    by : str
        The compared column.
    measure, unit : str
        Measure of the medians and its unit; "" for none.
    level : float
        Level of the intervals.
    pairs : tuple of Pair
        The comparisons.
    """

    by: str
    measure: str
    unit: str
    level: float
    pairs: tuple[Pair, ...]

    def _title(self) -> str:
        """Return the title of the table."""
        return f"{self.by}: the same draws compared"

    def _texts(self) -> list[list[str]]:
        """Return the columns of the table, without empty ones."""
        pairs, percent = self.pairs, f"{100 * self.level:g} %"
        columns = [
            ["first", *(pair.first for pair in pairs)],
            ["second", *(pair.second for pair in pairs)],
            ["draws", *(str(pair.difference.of) for pair in pairs)],
            *(
                [name.replace("_", " "), *(str(getattr(pair.counts, name)) for pair in pairs)]
                for name in PairCounts._fields[:4]
            ),
            [f"difference, % [{percent}]", *(pair.difference.text("+z.1f", 100) for pair in pairs)],
            ["p", *(_format_p_value(pair.p) for pair in pairs)],
        ]
        if len(pairs) > 1:
            columns.append(["p (Holm)", *(_format_p_value(pair.p_holm) for pair in pairs)])
        if self.measure:
            head = f"{self.measure}{f', {self.unit}' if self.unit else ''} [{percent}]"
            columns.append([head, *(pair.median.text() for pair in pairs)])
        return columns

    def _numbers(self) -> list[Sequence[object]]:
        """Return the head and the rows, in full precision."""
        median = [f"{self.measure}{end}" for end in ("", "_low", "_high")] if self.measure else []
        difference = ["difference", "difference_low", "difference_high"]
        head = ["first", "second", *PairCounts._fields, "p", "p_holm", *difference, *median]
        rows = [
            [pair.first, pair.second, *pair.counts, pair.p, pair.p_holm, *pair.difference.numbers]
            for pair in self.pairs
        ]
        medians = [pair.median.numbers[: len(median)] for pair in self.pairs]
        return [head, *([*row, *of] for row, of in zip(rows, medians, strict=True))]

    def _notes(self) -> list[str]:
        """Return the notes below the table."""
        lines = [
            "draws with two runs that could begin; difference: converged share of the first minus "
            "the share of the second; p: McNemar's exact test"
        ]
        if self.measure:
            lines.append(
                f"{self.measure}: median of first minus second, over draws with both converged"
            )
        left_out = dict.fromkeys(_describe_excluded(pair.counts) for pair in self.pairs)
        if len(left_out) == 1:
            return lines + [f"note: {why}" for why in left_out if why]
        pairs = (
            (f"{pair.first}, {pair.second}", _describe_excluded(pair.counts)) for pair in self.pairs
        )
        return lines + [f"note: {names}: {why}" for names, why in pairs if why]


def _describe_excluded(counts: PairCounts) -> str:
    """Return the draws that are not counted and the reason; empty if all are."""
    apart = f"{counts.apart} draws have a run that could not begin" if counts.apart else ""
    missing = f"{counts.missing} draws lack a run" if counts.missing else ""
    why = ", ".join(text for text in (apart, missing) if text)
    return f"{why}: not counted" if why else ""


def _format_p_value(p: float) -> str:
    """Return p with two digits, or "<1e-300" below the smallest number."""
    return "<1e-300" if p < 1e-300 else f"{p:.2g}"


def compare_paired(
    study: StudyData, by: str = "task", measure: str | None = "end_time", *, level: float = 0.95
) -> PairedComparison:
    """Compare the values of a column, such as tasks, on the same draws of a study.

    For each pair of values the result has the numbers of draws with both, one or neither run
    converged; McNemar's exact test; the difference of the shares with the interval of Newcombe's
    method 10; and the median difference of the measure with a distribution-free interval (see
    `robsim.statistics.paired_tests`). For several pairs the p-values are also corrected by the
    method of Holm (1979, "A simple sequentially rejective multiple test procedure"). Comparison on
    the same draws is more sensitive than comparison on independent draws: a draw that is difficult
    for one value is usually difficult for the other.

    Parameters
    ----------
    study : StudyResult or DataFrame
        A study, or its table with the columns draw, outcome, began and `by`.
    by : str, default "task"
        The compared column. Runs of the same draw must differ in this column only.
    measure : str or None, default "end_time"
        Column of numbers for the median differences.
    level : float, default 0.95
        Level of the intervals.

    Returns
    -------
    PairedComparison
        The comparisons of all pairs of values.

    Raises
    ------
    InputError
        If a column does not exist, has one value only, or has several runs of a value in one draw;
        or if no draw has two of the values.

    Examples
    --------
    >>> import pandas as pd
    >>> outcomes = ["CONVERGED", "LOCAL_MINIMUM"] * 6 + ["CONVERGED"] * 4
    >>> rows = {"draw": [i // 2 for i in range(16)], "task": ["PBVS", "IBVS"] * 8}
    >>> table = pd.DataFrame({**rows, "outcome": outcomes, "began": True})
    >>> [pair] = compare_paired(table, measure=None).pairs
    >>> pair.counts.both, pair.counts.only_first, pair.p, str(pair.difference)
    (2, 6, 0.03125, '+0.75 [+0.28, +0.929]')
    """
    check_level(level)
    table = table_columns.get_table(study)
    labels, rows = _arrange_by_draw(table, by)
    values = None if measure is None else table_columns.read_numbers(table, measure)
    converged = table_columns.read_outcomes(table) == Outcome.CONVERGED
    runs = table["began"].to_numpy(bool), converged, values
    pairs = []
    for i, j in combinations(range(len(labels)), 2):
        counts, differences = _count_pair(rows[:, i], rows[:, j], *runs)
        p = mcnemar(counts.only_first, counts.only_second)
        estimates = paired_difference(*counts[:4], level), median_interval(differences, level)
        pairs.append(Pair(labels[i], labels[j], counts, p, p, *estimates))
    if not any(pair.difference.of + pair.counts.apart for pair in pairs):
        raise InputError(f"no draw has runs with two values of {by!r}")
    unit = table_columns.get_unit(table, measure) if measure else ""
    return PairedComparison(by, measure or "", unit, level, tuple(_correct_by_holm(pairs)))


def _arrange_by_draw(table: pd.DataFrame, by: str) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """Return the compared values, and their rows (draws, values); -1 if missing."""
    if by == "draw":
        raise InputError("all compared runs share their draws: compare another column")
    table_columns.group_column(table, by, MOST_COMPARED)
    labels, index = table_columns.group_varied_column(table, by)
    draws, draw = np.unique(table_columns.read_numbers(table, "draw"), return_inverse=True)
    rows = np.full((len(draws), len(labels)), -1, np.intp)
    present = np.flatnonzero(index >= 0)
    rows[draw[present], index[present]] = present
    repeated = present[rows[draw[present], index[present]] != present]
    if repeated.size:
        first = int(repeated[0])
        raise InputError(
            f"draw {draws[draw[first]]:g} has several runs with {by} {labels[index[first]]}: "
            "select runs that agree in all other columns, as in table[table['...'] == ...]"
        )
    return labels, rows


def _count_pair(
    first: NDArray[np.intp],
    second: NDArray[np.intp],
    began: NDArray[np.bool_],
    converged: NDArray[np.bool_],
    values: Array | None,
) -> tuple[PairCounts, Array]:
    """Return the counts of draws and the differences of the measure.

    `first` and `second` (draws,) are the rows of the two runs of each draw, -1 for a missing run.
    """
    complete = (first >= 0) & (second >= 0)
    missing = int(((first >= 0) | (second >= 0)).sum() - complete.sum())
    one, two = first[complete], second[complete]
    both_began = began[one] & began[two]
    one, two = one[both_began], two[both_began]
    a, b = converged[one], converged[two]
    kinds = (a & b, a & ~b, ~a & b, ~a & ~b, ~both_began)
    counts = PairCounts._make([*(int(each.sum()) for each in kinds), missing])
    differences = np.empty(0) if values is None else (values[one] - values[two])[a & b]
    return counts, differences[np.isfinite(differences)]


def _correct_by_holm(pairs: list[Pair]) -> list[Pair]:
    """Return the pairs with p-values corrected by the step-down method of Holm."""
    order = np.argsort([pair.p for pair in pairs], kind="stable")
    multiplied = np.array([pairs[i].p for i in order]) * np.arange(len(pairs), 0, -1)
    corrected = np.minimum(np.maximum.accumulate(multiplied), 1.0)
    result = list(pairs)
    for i, p in zip(order, corrected, strict=True):
        result[i] = replace(pairs[i], p_holm=float(p))
    return result
