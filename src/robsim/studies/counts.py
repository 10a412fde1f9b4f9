"""How the runs of a study ended: counts with intervals, of those that began."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robsim.analysis.shares import Share, share
from robsim.base.errors import InputError, said, suggest
from robsim.base.html import table as html
from robsim.run.outcome import Outcome

if TYPE_CHECKING:
    import pandas as pd

MOST_GROUPS = 200


@dataclass(frozen=True)
class Counts:
    """The outcomes of the runs that began, for each group; those that could not begin apart.

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

    def __str__(self) -> str:
        """Return the table as text."""
        head, *rows = self._cells(str)
        widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        lines = [
            "  ".join(
                x.ljust(w) if i == 0 else x.rjust(w)
                for i, (x, w) in enumerate(zip(row, widths, strict=True))
            )
            for row in (head, *rows)
        ]
        return "\n".join([*(line.rstrip() for line in lines), *self.notes])

    def __repr__(self) -> str:
        """Return the table, also where a notebook shows it as text."""
        return str(self)

    def _repr_html_(self) -> str:
        """Return the table for notebooks."""
        head, *rows = self._cells(str)
        return html("Outcomes", rows, head, "\n".join(self.notes))

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

    def csv(self) -> str:
        """Return the table as comma-separated values, with the ends of the intervals."""
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        ends = [f"{name} {part}" for name in self.outcomes for part in ("count", "low", "high")]
        rows.writerow([self.by or "runs of", "runs", "began", *ends])
        for label, (count, began, shares) in self.rows.items():
            found = [shares.get(name, share(0, began)) for name in self.outcomes]
            rows.writerow(
                [label, count, began, *(x for s in found for x in (s.count, s.low, s.high))]
            )
        return text.getvalue()

    def latex(self) -> str:
        """Return the table as a LaTeX tabular."""
        head, *rows = self._cells(_latex_share)
        lines = [
            " & ".join(map(_escaped, head)),
            *(" & ".join([_escaped(row[0]), *row[1:]]) for row in rows),
        ]
        first, rest = lines[0], lines[1:]
        body = " \\\\\n".join(rest)
        return (
            f"\\begin{{tabular}}{{l{'r' * (len(head) - 1)}}}\n\\hline\n{first} \\\\\n\\hline\n"
            f"{body} \\\\\n\\hline\n\\end{{tabular}}\n% " + "\n% ".join(self.notes) + "\n"
        )

    def _cells(self, text: Any) -> list[list[str]]:
        names = self.outcomes
        head = [self.by or "", "runs", "began", *(Outcome[name].words for name in names)]
        rows = [
            [label, str(count), str(began), *(text(shares.get(n, share(0, began))) for n in names)]
            for label, (count, began, shares) in self.rows.items()
        ]
        return [head, *rows]


def _latex_share(value: Share) -> str:
    return str(value).replace("%", "\\%")


def _escaped(text: str) -> str:
    return "".join(f"\\{c}" if c in "#$%&_{}" else c for c in text.replace("\\", "/"))


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
