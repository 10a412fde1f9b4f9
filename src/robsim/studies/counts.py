"""How the runs of a study ended: counts with intervals, of those that began."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from robsim.base.errors import InputError, said, suggest
from robsim.base.tables import Printed
from robsim.engine.outcome import Outcome
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import clustered, share
from robsim.studies.reading import groups_of

MOST_GROUPS = 200


@dataclass(frozen=True, repr=False)
class Counts(Printed):
    """The outcomes of the runs that began, for each group; printed as a table.

    `rows` has for each group the number of runs, how many began, and the share of each outcome
    with its interval of Wilson at 95 %. `tries` are the starts that would do and all that were
    drawn, if they were. `pooled`: whether a group has several runs of a draw, which are not
    independent of each other (see `robsim.statistics.proportions.clustered`).
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
            found = [shares.get(name, share(0, began)) for _, began, shares in self.rows.values()]
            columns.append([Outcome[name].words, *map(str, found)])
        return columns

    def _numbers(self) -> list[Sequence[object]]:
        """Return the head and the rows, with the counts and the ends of the intervals."""
        ends = [f"{name} {part}" for name in self.outcomes for part in ("count", "low", "high")]
        rows: list[Sequence[object]] = [[self.by or "of", "runs", "began", *ends]]
        for label, (runs, began, shares) in self.rows.items():
            found = [shares.get(name, share(0, began)) for name in self.outcomes]
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
            lines.append(f"starts that will do, of those drawn: {share(*self.tries)}")
        return lines


def counted(
    data: pd.DataFrame, by: str | None, tries: tuple[int, int] | None = None, of: int | None = None
) -> Counts:
    """Return the counts of a table, for each value of a column if one is named.

    `of` is how many runs there are to be, if not all are there.

    InputError: no such column, or too many values in it.
    """
    if by is None:
        return Counts(None, {"all": _row(data)}, tries, _pooled(data), of)
    if not len(data):
        return Counts(by, {}, tries, False, of)
    names = [str(each) for each in data]
    if by not in names:
        raise InputError(f"by: no column {said(by)}; {suggest(by, names, 'columns')}")
    groups = groups_of(data, by, MOST_GROUPS)
    parts = [data[groups.which == i] for i in range(len(groups.labels))]
    rows = {label: _row(part) for label, part in zip(groups.labels, parts, strict=True)}
    return Counts(by, rows, tries, any(map(_pooled, parts)), of)


def _pooled(data: pd.DataFrame) -> bool:
    return bool(data["draw"].duplicated().any())


def _row(data: pd.DataFrame) -> tuple[int, int, dict[str, Estimate]]:
    began = data[data["began"]]
    outcome, draw = began["outcome"].to_numpy(str), began["draw"].to_numpy()
    shares = {name: clustered(outcome == name, draw) for name in dict.fromkeys(outcome.tolist())}
    return len(data), len(began), shares
