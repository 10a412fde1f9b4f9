"""Counts of the outcomes of a study's runs, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from robsim.base.errors import InputError, format_value, suggest_names
from robsim.base.text_tables import TabularValue
from robsim.engine.outcome import Outcome
from robsim.run.end_variables import NO_START
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_clustered_share, estimate_share
from robsim.studies.table_columns import group_column

MOST_GROUPS = 200


@dataclass(frozen=True, repr=False)
class OutcomeCounts(TabularValue):
    """Outcomes of the runs that began, counted in groups; printed as a table.

    Attributes
    ----------
    by : str or None
        Column of the groups.
    rows : dict of str to tuple
        For each group: number of runs, number of runs that began, and the share of each outcome
        with its Wilson interval at 95 %.
    tries : tuple of int or None
        Number of accepted random starts, and of all attempts.
    pooled : bool
        Whether a group has several runs of a draw. Such runs are not independent, and the intervals
        account for it (see `robsim.statistics.proportions.estimate_clustered_share`).
    planned : int or None
        Number of planned runs.
    unstarted : dict of str to int
        Number of runs that could not begin, for each reason.

    Examples
    --------
    >>> import robsim as rs
    >>> one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=8)
    >>> counts = rs.study(one, 3, vary={"task.gain": [0.1, 1.0]}).counts("task.gain")
    >>> {gain: began for gain, (_, began, _) in counts.rows.items()}
    {'0.1': 3, '1': 3}
    """

    by: str | None
    rows: dict[str, tuple[int, int, dict[str, Estimate]]]
    tries: tuple[int, int] | None = None
    pooled: bool = False
    planned: int | None = None
    unstarted: dict[str, int] = field(default_factory=dict)

    @property
    def outcomes(self) -> list[str]:
        """The names of the outcomes that occur, in the order of `rs.Outcome`."""
        names = {name for _, _, shares in self.rows.values() for name in shares}
        return [each.name for each in Outcome if each.name in names]

    def _title(self) -> str:
        """Return the title of the table."""
        return "Outcomes"

    def _texts(self) -> list[list[str]]:
        """Return the columns as texts, each with its head first."""
        columns = [
            [self.by or "", *self.rows],
            ["runs", *(str(runs) for runs, _, _ in self.rows.values())],
            ["began", *(str(began) for _, began, _ in self.rows.values())],
        ]
        for name in self.outcomes:
            shares_of_outcome = [
                shares.get(name, estimate_share(0, began))
                for _, began, shares in self.rows.values()
            ]
            columns.append([Outcome[name].words, *map(str, shares_of_outcome)])
        return columns

    def _numbers(self) -> list[Sequence[object]]:
        """Return the head and the rows, with the counts and the ends of the intervals."""
        ends = [f"{name} {part}" for name in self.outcomes for part in ("count", "low", "high")]
        rows: list[Sequence[object]] = [[self.by or "of", "runs", "began", *ends]]
        for label, (runs, began, shares) in self.rows.items():
            estimates = [shares.get(name, estimate_share(0, began)) for name in self.outcomes]
            rows.append(
                [label, runs, began, *(x for s in estimates for x in (s.count, s.low, s.high))]
            )
        return rows

    def _notes(self) -> list[str]:
        """Return the notes below the table."""
        return self.notes

    @property
    def notes(self) -> list[str]:
        """Notes on the counted runs."""
        lines = ["shares of the runs that began, with intervals of Wilson at 95 %"]
        if self.pooled:
            lines.append(
                "runs of one draw are not independent: intervals use the effective number of runs"
            )
        runs = sum(count for count, _, _ in self.rows.values())
        lost = runs - sum(began for _, began, _ in self.rows.values())
        if self.planned is not None and runs < self.planned:
            lines.insert(
                0, f"{runs} of {self.planned} runs are finished: the study is not complete"
            )
        if lost:
            why = ", ".join(f"{count} {reason}" for reason, count in self.unstarted.items())
            lines.append(f"{lost} of {runs} runs could not begin and are not counted: {why}")
        if self.tries:
            lines.append(f"accepted starts, of all drawn: {estimate_share(*self.tries)}")
        return lines


def count_outcomes(
    data: pd.DataFrame, by: str | None, tries: tuple[int, int] | None = None, of: int | None = None
) -> OutcomeCounts:
    """Count the outcomes of a table, in total or for each value of the column `by`.

    `of` is the number of planned runs. Raises InputError if the column does not exist or has too
    many values.
    """
    if by is None:
        rows = {"all": _count_group(data)}
        return OutcomeCounts(None, rows, tries, _has_repeated_draws(data), of, _count_reasons(data))
    if not len(data):
        return OutcomeCounts(by, {}, tries, False, of)
    names = [str(each) for each in data]
    if by not in names:
        raise InputError(f"by: no column {format_value(by)}; {suggest_names(by, names, 'columns')}")
    groups = group_column(data, by, MOST_GROUPS)
    parts = [data[groups.which == i] for i in range(len(groups.labels))]
    rows = {label: _count_group(part) for label, part in zip(groups.labels, parts, strict=True)}
    pooled = any(map(_has_repeated_draws, parts))
    return OutcomeCounts(by, rows, tries, pooled, of, _count_reasons(data))


def _count_reasons(data: pd.DataFrame) -> dict[str, int]:
    """Return the number of runs that could not begin, for each reason."""
    names, counts = np.unique(
        data["outcome"].to_numpy(str)[~data["began"].to_numpy(bool)], return_counts=True
    )
    reasons: dict[str, int] = {}
    for name, count in zip(names.tolist(), counts.tolist(), strict=True):
        outcome = Outcome[name]
        reason = outcome.words if outcome in NO_START else "without a start within reach"
        reasons[reason] = reasons.get(reason, 0) + count
    return reasons


def _has_repeated_draws(data: pd.DataFrame) -> bool:
    """Return whether several rows have the same draw."""
    return bool(data["draw"].duplicated().any())


def _count_group(data: pd.DataFrame) -> tuple[int, int, dict[str, Estimate]]:
    """Return the number of runs, the number that began, and the share of each outcome."""
    began = data[data["began"]]
    outcome, draw = began["outcome"].to_numpy(str), began["draw"].to_numpy()
    shares = {
        name: estimate_clustered_share(outcome == name, draw)
        for name in dict.fromkeys(outcome.tolist())
    }
    return len(data), len(began), shares
