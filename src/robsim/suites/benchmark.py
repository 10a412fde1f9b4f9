"""`Benchmark`: success rates of schemes on suites, as rows and as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from robsim import __version__
from robsim.suites.reproduction import Reproduction
from robsim.suites.suite import Suite
from robsim.suites.suite_tables import SuiteTable, count_suite


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Counted runs of schemes on suites; printed as a table for each suite.

    Attributes
    ----------
    suites : tuple of Suite
        The simulated suites.
    data : DataFrame
        A row for each run: suite, version, scheme, run, draw, groups and columns of the suite,
        outcome, began, success, time (s), path_length and distances (m), angles (rad); for suites
        of published numbers also value, expected and within. Runs of one `draw` are not
        independent. Runs with `began` false are not counted: their start does not see the marks.

    Examples
    --------
    >>> from robsim import IBVS, bench
    >>> result = bench("vit_500", {"slow": IBVS(depth_scale=2.0)}, builtin=False)
    >>> result.table[["scheme", "successes", "runs"]].values.tolist()
    [['slow', 391, 412]]
    """

    suites: tuple[Suite | Reproduction, ...]
    data: pd.DataFrame

    @property
    def table(self) -> pd.DataFrame:
        """A table with a row for each suite, group and scheme.

        `successes` among the `runs` that began have a Wilson interval from `low` to `high`, of the
        effective number of independent runs if some runs have the same draw (see
        `robsim.statistics.proportions.estimate_clustered_share`).
        `not_begun` counts the other runs. The medians `time` (s) and `path_length` (m) are over
        successful runs, and `distance_to_goal` (m) and `angle_to_goal` (rad) over runs that began.
        """
        parts = [count_suite(each.suite, each.rows) for each in self._tables]
        return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()

    def csv(self) -> str:
        """Return the table as comma-separated values, in full precision."""
        return str(self.table.to_csv(index=False, lineterminator="\n"))

    def latex(self) -> str:
        """Return a LaTeX tabular for each suite, for \\usepackage{booktabs}."""
        return "\n\n".join(each.latex() for each in self._tables) + "\n"

    def __str__(self) -> str:
        """Return a table for each suite, with its criterion of success and its source."""
        return "\n\n".join(map(str, self._tables))

    def __repr__(self) -> str:
        """Return the tables; notebooks show them as text."""
        return str(self)

    def _repr_html_(self) -> str:
        """Return the tables for notebooks."""
        return "".join(each._repr_html_() for each in self._tables)

    @property
    def _tables(self) -> list[SuiteTable]:
        """The table of each suite."""
        every = self.data
        return [SuiteTable(suite, every[every["suite"] == suite.name]) for suite in self.suites]


def assemble_benchmark(
    suites: Sequence[Suite | Reproduction], parts: Sequence[pd.DataFrame]
) -> Benchmark:
    """Return the benchmark of suites from the rows of all trials; empty suites are dropped."""
    filled = [part for part in parts if len(part)]
    data = pd.concat(filled or parts[:1], ignore_index=True)
    data.attrs = {"robsim": __version__}
    present = set(data["suite"])
    return Benchmark(tuple(each for each in suites if each.name in present), data)
