"""How the runs of a study ended: counts with intervals, of those that began."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robsim.analysis.shares import Share, share
from robsim.base.errors import InputError, said, suggest
from robsim.base.tables import Printed
from robsim.run.outcome import Outcome

if TYPE_CHECKING:
    import pandas as pd

MOST_GROUPS = 200


@dataclass(frozen=True, repr=False)
class Counts(Printed):
    """The outcomes of the runs that began, for each group; printed as a table.

    `rows` has for each group the number of runs, how many began, and the share of each outcome
    with its interval of Wilson at 95 %. `tries` are the starts that would do and all that were
    drawn, if they were.
    """

    by: str | None
    rows: dict[str, tuple[int, int, dict[str, Share]]]
    tries: tuple[int, int] | None = None

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
        runs = sum(count for count, _, _ in self.rows.values())
        lost = runs - sum(began for _, began, _ in self.rows.values())
        if lost:
            lines.append(f"{lost} of {runs} runs could not begin, and count nothing")
        if self.tries:
            lines.append(f"starts that will do, of those drawn: {share(*self.tries)}")
        return lines


def counted(data: pd.DataFrame, by: str | None, tries: tuple[int, int] | None = None) -> Counts:
    """Return the counts of a table, for each value of a column if one is named.

    InputError: no such column, or too many values in it.
    """
    if by is None:
        return Counts(None, {"all": _row(data)}, tries)
    names = [str(each) for each in data]
    if by not in names:
        raise InputError(f"by: no column {said(by)}; {suggest(by, names, 'columns')}")
    groups = data.groupby(by, sort=True, observed=True)
    if groups.ngroups > MOST_GROUPS:
        raise InputError(
            f"by: {by!r} has {groups.ngroups} values; at most {MOST_GROUPS} are counted apart"
        )
    rows = {_label(value): _row(part) for value, part in groups}
    return Counts(by, rows, tries)


def _label(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _row(data: pd.DataFrame) -> tuple[int, int, dict[str, Share]]:
    began = data[data["began"]]
    found = began["outcome"].value_counts()
    shares = {str(name): share(int(n), len(began)) for name, n in found.items() if n}
    return len(data), len(began), shares
