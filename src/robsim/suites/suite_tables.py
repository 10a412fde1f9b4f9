"""Tables of a benchmark: success rates with intervals, medians and verdicts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from robsim.base.text_tables import TabularValue, format_digits
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_clustered_share
from robsim.suites.reproduction import Reproduction
from robsim.suites.suite import Suite

MEDIANS = {  # by variable: runs that count, head, and factor from SI units
    "time": ("success", "time (s)", 1.0),
    "path_length": ("success", "path (m)", 1.0),
    "distance_to_goal": ("began", "off (mm)", 1e3),
    "angle_to_goal": ("began", "off (deg)", 180.0 / np.pi),
}


@dataclass(frozen=True, repr=False)
class SuiteTable(TabularValue):
    """The rows of a suite as a table, with the criterion of success and the source."""

    suite: Suite | Reproduction
    rows: pd.DataFrame

    def _title(self) -> str:
        """Return the title of the table."""
        return f"{self.suite.name}, version {self.suite.version}: {self.suite.title}"

    def _texts(self) -> list[list[str]]:
        """Return the columns as texts."""
        if isinstance(self.suite, Reproduction):
            return _verdict_columns(self.rows)
        table = count_suite(self.suite, self.rows)
        return _crossed_columns(self.suite, table) if self.suite.crossed else _group_columns(table)

    def _notes(self) -> list[str]:
        """Return the notes below the table."""
        return [*_suite_notes(self.suite, self.rows), f"source: {self.suite.source}"]

    def __str__(self) -> str:
        """Return the table with its title and its notes."""
        return f"{self._title()}\n{super().__str__()}"

    def latex(self) -> str:
        """Return the table as LaTeX for \\usepackage{booktabs}, with its title as a comment."""
        return f"% {self._title()}\n{super().latex()}"


def count_suite(suite: Suite | Reproduction, rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each group and scheme of a suite, as in `Benchmark.table`."""
    schemes = list(dict.fromkeys(rows["scheme"]))
    cells = [("all", None)] if isinstance(suite, Reproduction) else suite.cells()
    return pd.DataFrame(
        {"suite": suite.name, "version": suite.version, "group": label, **_count_scheme(name, some)}
        for label, members in cells
        for name in schemes
        for some in [_select_members(rows, name, members)]
    )


def _select_members(rows: pd.DataFrame, scheme: str, members: Any) -> pd.DataFrame:
    """Return the rows of a scheme with runs in a group; all its rows if `members` is None."""
    own = rows[rows["scheme"] == scheme]
    return own if members is None else own[members[own["run"].to_numpy()]]


def _count_scheme(scheme: str, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the success rate of the runs of a scheme, and medians."""
    began, success = (rows[key].to_numpy(dtype=bool) for key in ("began", "success"))
    estimate = estimate_clustered_share(success[began], rows["draw"].to_numpy()[began])
    row = {
        "scheme": scheme,
        "successes": estimate.count,
        "runs": estimate.of,
        "low": estimate.low,
        "high": estimate.high,
        "not_begun": int((~began).sum()),
    }
    chosen = {"success": success, "began": began}
    present = {key: of for key, (of, *_) in MEDIANS.items() if key in rows}
    return row | {
        key: _median_or_nan(rows[key].to_numpy()[chosen[of]]) for key, of in present.items()
    }


def _median_or_nan(values: Any) -> float:
    """Return the median of values; NaN if there are none."""
    return float(np.median(values)) if len(values) else np.nan


def _verdict_columns(rows: pd.DataFrame) -> list[list[str]]:
    """Return columns of published numbers, their present values, and the verdicts."""
    numbers = {
        key: [f"{format_digits(x)} {unit}" for x, unit in zip(rows[key], rows["unit"], strict=True)]
        for key in ("value", "expected", "within")
    }
    verdict = ["agrees" if good else "DIFFERS" for good in rows["success"]]
    texts = {"case": [*rows["scheme"]], "measure": [*rows["measure"]], **numbers}
    return [[head, *cells] for head, cells in {**texts, "verdict": verdict}.items()]


def _group_columns(table: pd.DataFrame) -> list[list[str]]:
    """Return columns with a row for each group and scheme; repeated group names are blank."""
    groups = table["group"].tolist()
    shown_groups = ["" if i and groups[i - 1] == each else each for i, each in enumerate(groups)]
    columns = [
        ["group", *shown_groups],
        ["scheme", *table["scheme"]],
        ["success", *map(str, _read_shares(table))],
    ]
    columns.append(["of", *map(str, table["runs"])])
    if table["not_begun"].any():
        columns.append(["not begun", *map(str, table["not_begun"])])
    for key, (_, head, factor) in MEDIANS.items():
        columns.append([head, *(format_digits(factor * value) for value in table[key])])
    return columns


def _crossed_columns(suite: Suite, table: pd.DataFrame) -> list[list[str]]:
    """Return a column for each label of the second group; rows are schemes and first labels."""
    first, second = (list(dict.fromkeys(each)) for each in suite.groups.values())
    schemes = list(dict.fromkeys(table["scheme"]))
    texts = [*map(_format_cell, _read_shares(table), table["time"])]
    cells = table.assign(text=texts).set_index(["scheme", "group"])["text"]
    pairs = [(scheme, label) for scheme in schemes for label in first]
    names = [scheme if label == first[0] else "" for scheme, label in pairs]
    columns = [["scheme", *names], [" x ".join(suite.groups), *(label for _, label in pairs)]]
    for label in second:
        columns.append([label, *(cells[scheme, f"{row}, {label}"] for scheme, row in pairs)])
    return columns


def _read_shares(table: pd.DataFrame) -> list[Estimate]:
    """Return the success rates with their intervals."""
    columns = (table[each] for each in ("successes", "runs", "low", "high"))
    return [
        Estimate(count / of if of else np.nan, low, high, of, "%")
        for count, of, low, high in zip(*columns, strict=True)
    ]


def _format_cell(share: Estimate, time: float) -> str:
    """Return a success rate in whole percent, its interval, and a time."""
    value, low, high = (100 * each for each in share.numbers)
    return f"{value:.0f} [{low:.0f}, {high:.0f}]  {format_digits(time)}"


def _suite_notes(suite: Suite | Reproduction, rows: pd.DataFrame) -> Iterator[str]:
    """Yield the notes below the table."""
    yield f"success: {suite.criterion}"
    if isinstance(suite, Reproduction):
        return
    yield "intervals: Wilson, 95 %; time and path: medians of the runs that succeed"
    if rows.duplicated(["scheme", "draw"]).any():
        yield "runs of one draw are not independent: intervals use the effective number of runs"
    if suite.crossed:
        yield "cells: percent that succeed [interval]  seconds"
    else:
        yield "off: medians of the final offset from the goal, over the runs that began"
    if not rows["began"].all():
        yield "not begun: the start does not see the marks that a scheme needs; not counted"
