"""Schemes compared on the same draws: which succeeds more often, and which is better if both do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

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

MOST_COMPARED = 20  # values, which make 190 pairs


class PairCounts(NamedTuple):
    """Draws counted by which of two runs converged, and those that do not count.

    The first four are of the draws in which both could begin. `apart` are those in which one of the
    two, or both, could not, and `missing` those that lack one of the two runs.
    """

    both: int
    only_first: int
    only_second: int
    neither: int
    apart: int
    missing: int


@dataclass(frozen=True)
class Pair:
    """Two values of the column that is compared, such as two tasks, on the same draws.

    `p` is that of McNemar's exact test on the draws in which one alone converged, and `p_holm` the
    same corrected for as many pairs as are compared. `difference` is the share of the first that
    converged less that of the second, `median` the median of a measure of the first less that of
    the second in the same draw, where both converged.
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
    """The pairs of values of a column, compared on the same draws; printed as a table.

    `by` is the column that is compared, `measure` what the medians are of, "" for none, `unit` its
    unit, and `level` that of the intervals.
    """

    by: str
    measure: str
    unit: str
    level: float
    pairs: tuple[Pair, ...]

    def _title(self) -> str:
        return f"{self.by}: the same draws compared"

    def _texts(self) -> list[list[str]]:
        """Return the columns of the table; those that say nothing are left out."""
        pairs, percent = self.pairs, f"{100 * self.level:g} %"
        shown = [
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
            shown.append(["p (Holm)", *(_format_p_value(pair.p_holm) for pair in pairs)])
        if self.measure:
            head = f"{self.measure}{f', {self.unit}' if self.unit else ''} [{percent}]"
            shown.append([head, *(pair.median.text() for pair in pairs)])
        return shown

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
        lines = [
            "draws in which both could begin; difference: share of the first that converged less "
            "that of the second; p: McNemar's exact test"
        ]
        if self.measure:
            lines.append(
                f"{self.measure}: median of first less second, over draws in which both converged"
            )
        left_out = dict.fromkeys(_describe_excluded(pair.counts) for pair in self.pairs)
        if len(left_out) == 1:
            return lines + [f"note: {why}" for why in left_out if why]
        pairs = (
            (f"{pair.first}, {pair.second}", _describe_excluded(pair.counts)) for pair in self.pairs
        )
        return lines + [f"note: {names}: {why}" for names, why in pairs if why]


def _describe_excluded(counts: PairCounts) -> str:
    """Return which draws do not count, and why; empty if all do."""
    apart = f"in {counts.apart} draws one or both could not begin" if counts.apart else ""
    missing = f"in {counts.missing} draws one was not run" if counts.missing else ""
    why = ", ".join(text for text in (apart, missing) if text)
    return f"{why}: they do not count" if why else ""


def _format_p_value(p: float) -> str:
    """Return p to two digits; those below the smallest number are told as such."""
    return "<1e-300" if p < 1e-300 else f"{p:.2g}"


def compare_paired(
    study: Any, by: str = "task", measure: str | None = "end_time", *, level: float = 0.95
) -> PairedComparison:
    """Compare the values of a column, such as tasks, on the same draws of a study.

    study       a study, or its table with the columns draw, outcome, began and `by`
    by          the column that is compared; runs of the same draw differ in it alone
    measure     a column of numbers, of which the medians of the differences are told, where both
                converged; None for none

    For each pair of values: in how many draws both, one alone, or neither converged; the exact test
    of McNemar; the difference of the shares with the interval of Newcombe's method 10; and the
    median of the differences of the measure with an interval that holds for any distribution (see
    `robsim.statistics.paired_tests`). With several pairs the p are also corrected by Holm (1979, "A
    simple sequentially rejective multiple test procedure"). The same draws tell more than as many
    others: what makes a draw hard is the same for both.

    InputError: a column that is not there, one value only, several runs of a value in one draw, or
    no draw that has two of the values.

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
    arrived = table_columns.read_outcomes(table) == Outcome.CONVERGED
    runs = table["began"].to_numpy(bool), arrived, values
    pairs = []
    for i, j in combinations(range(len(labels)), 2):
        counts, away = _count_pair(rows[:, i], rows[:, j], *runs)
        p = mcnemar(counts.only_first, counts.only_second)
        found = paired_difference(*counts[:4], level), median_interval(away, level)
        pairs.append(Pair(labels[i], labels[j], counts, p, p, *found))
    if not any(pair.difference.of + pair.counts.apart for pair in pairs):
        raise InputError(f"no draw has runs with two values of {by!r}: nothing can be compared")
    unit = table_columns.get_unit(table, measure) if measure else ""
    return PairedComparison(by, measure or "", unit, level, tuple(_correct_by_holm(pairs)))


def _arrange_by_draw(table: pd.DataFrame, by: str) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """Return the compared values, and the row (draws, values) of each in each draw; -1 for none."""
    if by == "draw":
        raise InputError("the draws are the same for all that is compared: compare another column")
    table_columns.group_column(table, by, MOST_COMPARED)
    labels, index = table_columns.group_varied_column(table, by)
    draws, draw = np.unique(table_columns.read_numbers(table, "draw"), return_inverse=True)
    rows = np.full((len(draws), len(labels)), -1, np.intp)
    there = np.flatnonzero(index >= 0)
    rows[draw[there], index[there]] = there
    twice = there[rows[draw[there], index[there]] != there]
    if twice.size:
        first = int(twice[0])
        raise InputError(
            f"draw {draws[draw[first]]:g} has several runs with {by} {labels[index[first]]}: take "
            "those that agree in everything else, as in table[table['...'] == ...]"
        )
    return labels, rows


def _count_pair(
    first: NDArray[np.intp],
    second: NDArray[np.intp],
    started: NDArray[np.bool_],
    arrived: NDArray[np.bool_],
    values: Array | None,
) -> tuple[PairCounts, Array]:
    """Return counts of draws (both, first, second, neither, apart, missing), and differences.

    `first` and `second` (draws,) are the rows of the two runs of each draw, -1 for none.
    """
    there = (first >= 0) & (second >= 0)
    missing = int(((first >= 0) | (second >= 0)).sum() - there.sum())
    one, two = first[there], second[there]
    begun = started[one] & started[two]
    one, two = one[begun], two[begun]
    a, b = arrived[one], arrived[two]
    kinds = (a & b, a & ~b, ~a & b, ~a & ~b, ~begun)
    counts = PairCounts._make([*(int(each.sum()) for each in kinds), missing])
    away = np.empty(0) if values is None else (values[one] - values[two])[a & b]
    return counts, away[np.isfinite(away)]


def _correct_by_holm(pairs: list[Pair]) -> list[Pair]:
    """Return the pairs with their p corrected for as many as there are, by the steps of Holm."""
    order = np.argsort([pair.p for pair in pairs], kind="stable")
    raised = np.array([pairs[i].p for i in order]) * np.arange(len(pairs), 0, -1)
    corrected = np.minimum(np.maximum.accumulate(raised), 1.0)
    found = list(pairs)
    for i, p in zip(order, corrected, strict=True):
        found[i] = replace(pairs[i], p_holm=float(p))
    return found
