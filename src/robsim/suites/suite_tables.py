"""What the tables of a benchmark show: shares with intervals, medians, verdicts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from robsim.base.text_tables import TabularValue, format_digits
from robsim.statistics.proportions import estimate_share
from robsim.suites.reproduction import Reproduction
from robsim.suites.suite import Suite

MEDIANS = {  # of the runs that succeeded, or of those that began: head, and factor of SI
    "time": ("success", "time (s)", 1.0),
    "path_length": ("success", "path (m)", 1.0),
    "distance_to_goal": ("began", "off (mm)", 1e3),
    "angle_to_goal": ("began", "off (deg)", 180.0 / np.pi),
}


@dataclass(frozen=True, repr=False)
class SuiteTable(TabularValue):
    """The rows of a suite as a table, with what counts as success, and where it comes from."""

    suite: Suite | Reproduction
    rows: pd.DataFrame

    def _title(self) -> str:
        return f"{self.suite.name}, version {self.suite.version}: {self.suite.title}"

    def _texts(self) -> list[list[str]]:
        if isinstance(self.suite, Reproduction):
            return _verdict_columns(self.rows)
        table = count_suite(self.suite, self.rows)
        return _crossed_columns(self.suite, table) if self.suite.crossed else _group_columns(table)

    def _notes(self) -> list[str]:
        return [*_suite_notes(self.suite, self.rows), f"source: {self.suite.source}"]

    def __str__(self) -> str:
        """Return the table with its title and its notes."""
        return f"{self._title()}\n{super().__str__()}"

    def latex(self) -> str:
        """Return the table as LaTeX, for \\usepackage{booktabs}, with its title as a remark."""
        return f"% {self._title()}\n{super().latex()}"


def count_suite(suite: Suite | Reproduction, rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each group and scheme of a suite, as `Benchmark.table` has them."""
    schemes = list(dict.fromkeys(rows["scheme"]))
    cells = [("all", None)] if isinstance(suite, Reproduction) else suite.cells()
    return pd.DataFrame(
        {"suite": suite.name, "version": suite.version, "group": label, **_count_scheme(name, some)}
        for label, members in cells
        for name in schemes
        for some in [_select_members(rows, name, members)]
    )


def _select_members(rows: pd.DataFrame, scheme: str, members: Any) -> pd.DataFrame:
    """Return the rows of a scheme whose runs are members of a group; None: all."""
    own = rows[rows["scheme"] == scheme]
    return own if members is None else own[members[own["run"].to_numpy()]]


def _count_scheme(scheme: str, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the share of the runs of a scheme that succeed, and medians."""
    began, success = (rows[key].to_numpy(dtype=bool) for key in ("began", "success"))
    found = estimate_share(int(success.sum()), int(began.sum()))
    made = {
        "scheme": scheme,
        "successes": found.count,
        "runs": found.of,
        "low": found.low,
        "high": found.high,
        "not_begun": int((~began).sum()),
    }
    chosen = {"success": success, "began": began}
    present = {key: of for key, (of, *_) in MEDIANS.items() if key in rows}
    return made | {
        key: _median_or_nan(rows[key].to_numpy()[chosen[of]]) for key, of in present.items()
    }


def _median_or_nan(values: Any) -> float:
    return float(np.median(values)) if len(values) else np.nan


def _verdict_columns(rows: pd.DataFrame) -> list[list[str]]:
    """Return columns of published numbers, what they are now, and whether that agrees."""
    numbers = {
        key: [f"{format_digits(x)} {unit}" for x, unit in zip(rows[key], rows["unit"], strict=True)]
        for key in ("value", "expected", "within")
    }
    verdict = ["agrees" if good else "DIFFERS" for good in rows["success"]]
    texts = {"case": [*rows["scheme"]], "measure": [*rows["measure"]], **numbers}
    return [[head, *cells] for head, cells in {**texts, "verdict": verdict}.items()]


def _group_columns(table: pd.DataFrame) -> list[list[str]]:
    """Return columns with a row for each group and scheme; the group stands once."""
    groups = table["group"].tolist()
    once = ["" if i and groups[i - 1] == each else each for i, each in enumerate(groups)]
    found = [["group", *once], ["scheme", *table["scheme"]], ["success", *_format_shares(table)]]
    found.append(["of", *map(str, table["runs"])])
    if table["not_begun"].any():
        found.append(["not begun", *map(str, table["not_begun"])])
    for key, (_, head, factor) in MEDIANS.items():
        found.append([head, *(format_digits(factor * value) for value in table[key])])
    return found


def _crossed_columns(suite: Suite, table: pd.DataFrame) -> list[list[str]]:
    """Return columns of the second group, and rows for each scheme and label of the first."""
    first, second = (list(dict.fromkeys(each)) for each in suite.groups.values())
    schemes = list(dict.fromkeys(table["scheme"]))
    cells = table.assign(text=_format_cells(table)).set_index(["scheme", "group"])["text"]
    pairs = [(scheme, label) for scheme in schemes for label in first]
    names = [scheme if label == first[0] else "" for scheme, label in pairs]
    found = [["scheme", *names], [" x ".join(suite.groups), *(label for _, label in pairs)]]
    for label in second:
        found.append([label, *(cells[scheme, f"{row}, {label}"] for scheme, row in pairs)])
    return found


def _format_shares(table: pd.DataFrame) -> list[str]:
    counts = zip(table["successes"], table["runs"], strict=True)
    return [str(estimate_share(int(count), int(of))) for count, of in counts]


def _format_cells(table: pd.DataFrame) -> list[str]:
    """Return shares in whole percent, each with its interval and the median time in seconds."""
    names = "successes", "runs", "time"
    return [_format_cell(*row) for row in zip(*(table[each] for each in names), strict=True)]


def _format_cell(count: int, of: int, time: float) -> str:
    found = estimate_share(int(count), int(of))
    value, low, high = (100 * each for each in (found.value, found.low, found.high))
    return f"{value:.0f} [{low:.0f}, {high:.0f}]  {format_digits(time)}"


def _suite_notes(suite: Suite | Reproduction, rows: pd.DataFrame) -> Iterator[str]:
    yield f"success: {suite.criterion}"
    if isinstance(suite, Reproduction):
        return
    yield "intervals: Wilson, 95 %; time and path: medians of the runs that succeed"
    if suite.crossed:
        yield "cells: percent that succeed [interval]  seconds"
    else:
        yield "off: medians of where the runs that began end, from the goal"
    if not rows["began"].all():
        yield "not begun: the start does not see the marks that a scheme needs; it counts nothing"
