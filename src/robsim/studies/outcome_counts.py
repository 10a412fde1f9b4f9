"""How the runs of a study ended: counts with intervals, of those that began."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from robsim.base.errors import InputError, format_value, suggest_names
from robsim.base.text_tables import TabularValue
from robsim.engine.outcome import Outcome
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_clustered_share, estimate_share
from robsim.studies.table_columns import group_column

MOST_GROUPS = 200


@dataclass(frozen=True, repr=False)
class OutcomeCounts(TabularValue):
    """The outcomes of the runs that began, for each group; printed as a table.

    `rows` has for each group the number of runs, how many began, and the share of each outcome
    with its interval of Wilson at 95 %. `tries` are the starts that would do and all that were
    drawn, if they were. `pooled`: whether a group has several runs of a draw, which are not
    independent of each other (see `robsim.statistics.proportions.estimate_clustered_share`).
    """

    by: str | None
    rows: dict[str, tuple[int, int, dict[str, Estimate]]]
    tries: tuple[int, int] | None = None
    pooled: bool = False
    planned: int | None = None

    @property
    def outcomes(self) -> list[str]:
        """The names of the outcomes that occur, in the order of `rs.Outcome`."""
        found = {name for _, _, shares in self.rows.values() for name in shares}
        return [each.name for each in Outcome if each.name in found]

    def _title(self) -> str:
        return "Outcomes"

    def _texts(self) -> list[list[str]]:
        """Return the columns as texts, each with its head first."""
        columns = [
            [self.by or "", *self.rows],
            ["runs", *(str(runs) for runs, _, _ in self.rows.values())],
            ["began", *(str(began) for _, began, _ in self.rows.values())],
        ]
        for name in self.outcomes:
            found = [
                shares.get(name, estimate_share(0, began))
                for _, began, shares in self.rows.values()
            ]
            columns.append([Outcome[name].words, *map(str, found)])
        return columns

    def _numbers(self) -> list[Sequence[object]]:
        """Return the head and the rows, with the counts and the ends of the intervals."""
        ends = [f"{name} {part}" for name in self.outcomes for part in ("count", "low", "high")]
        rows: list[Sequence[object]] = [[self.by or "of", "runs", "began", *ends]]
        for label, (runs, began, shares) in self.rows.items():
            found = [shares.get(name, estimate_share(0, began)) for name in self.outcomes]
            rows.append([label, runs, began, *(x for s in found for x in (s.count, s.low, s.high))])
        return rows

    def _notes(self) -> list[str]:
        return self.notes

    @property
    def notes(self) -> list[str]:
        """What the numbers count, and of how many."""
        lines = ["shares of the runs that began, with intervals of Wilson at 95 %"]
        if self.pooled:
            lines.append(
                "runs of one draw are not independent: the intervals count what they are worth"
            )
        runs = sum(count for count, _, _ in self.rows.values())
        lost = runs - sum(began for _, began, _ in self.rows.values())
        if self.planned is not None and runs < self.planned:
            lines.insert(0, f"{runs} of {self.planned} runs are done: the study is not complete")
        if lost:
            lines.append(f"{lost} of {runs} runs could not begin, and count nothing")
        if self.tries:
            lines.append(f"starts that will do, of those drawn: {estimate_share(*self.tries)}")
        return lines


def count_outcomes(
    data: pd.DataFrame, by: str | None, tries: tuple[int, int] | None = None, of: int | None = None
) -> OutcomeCounts:
    """Return the counts of a table, for each value of a column if one is named.

    `of` is how many runs there are to be, if not all are there.

    InputError: no such column, or too many values in it.
    """
    if by is None:
        return OutcomeCounts(
            None, {"all": _count_group(data)}, tries, _has_repeated_draws(data), of
        )
    if not len(data):
        return OutcomeCounts(by, {}, tries, False, of)
    names = [str(each) for each in data]
    if by not in names:
        raise InputError(f"by: no column {format_value(by)}; {suggest_names(by, names, 'columns')}")
    groups = group_column(data, by, MOST_GROUPS)
    parts = [data[groups.which == i] for i in range(len(groups.labels))]
    rows = {label: _count_group(part) for label, part in zip(groups.labels, parts, strict=True)}
    return OutcomeCounts(by, rows, tries, any(map(_has_repeated_draws, parts)), of)


def _has_repeated_draws(data: pd.DataFrame) -> bool:
    return bool(data["draw"].duplicated().any())


def _count_group(data: pd.DataFrame) -> tuple[int, int, dict[str, Estimate]]:
    began = data[data["began"]]
    outcome, draw = began["outcome"].to_numpy(str), began["draw"].to_numpy()
    shares = {
        name: estimate_clustered_share(outcome == name, draw)
        for name in dict.fromkeys(outcome.tolist())
    }
    return len(data), len(began), shares
