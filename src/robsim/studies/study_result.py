"""`StudyResult`: what came out of thousands of runs, as a table and as counts."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from robsim.base.arrays import as_integer
from robsim.base.atomic_files import write_whole
from robsim.base.errors import InputError, ReplayWarning, format_value
from robsim.base.free_memory import get_free_memory
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.statistics.estimate import Estimate
from robsim.statistics.proportions import estimate_clustered_share, estimate_share
from robsim.studies.outcome_counts import MOST_GROUPS, OutcomeCounts, count_outcomes
from robsim.studies.paired_comparison import PairedComparison, compare_paired
from robsim.studies.result_columns import TABLE_BYTES, Columns, make_table
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.sensitivity import Sensitivity, compute_sensitivity
from robsim.studies.study_plan import Plan
from robsim.studies.study_store import TRACKS, encode_parquet
from robsim.studies.study_text import format_plan
from robsim.studies.table_columns import get_column, group_column, read_numbers
from robsim.studies.trajectory_store import TrajectoryStore


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult:
    """The runs of a study: a table with a row for each, and its plan, by which they are repeated.

    `table` is a pandas DataFrame: the number of the run and of its draw, what differs from run to
    run, where it started (m, rad), and how it ended (see `robsim.studies.result_columns.COLUMN_MEANINGS`). Runs
    with `began` false have nothing to count: their start was out of sight, or beyond the limits of
    the joints. `str` of a study counts the outcomes, with intervals.
    """

    plan: Plan
    _read: Any = field(repr=False)  # returns (runs, columns)
    folder: Path | None = None

    @property
    def experiment(self) -> Experiment:
        """The experiment that was varied."""
        return self.plan.experiment

    @property
    def complete(self) -> bool:
        """Whether all runs of the plan are there."""
        return len(self.runs) == self.plan.runs

    @cached_property
    def _facts(self) -> tuple[Any, Columns]:
        found: tuple[Any, Columns] = self._read()
        return found

    @property
    def runs(self) -> Any:
        """The numbers (n,) of the runs that are there."""
        return self._facts[0]

    @cached_property
    def table(self) -> pd.DataFrame:
        """The table, one row a run; see the class."""
        need, free = len(self.runs) * TABLE_BYTES, get_free_memory()
        if need > free:
            raise InputError(
                f"a table of {len(self.runs)} runs needs about {need / 1e9:.3g} GB, and "
                f"{free / 1e9:.3g} GB are free; read the Parquet files of the store in parts"
            )
        return make_table(self.plan, *self._facts)

    def counts(self, by: str | None = None) -> OutcomeCounts:
        """Return how the runs ended, with intervals, for each value of a name if one is given."""
        return count_outcomes(self.table, by, self._tries(), self.plan.runs)

    def __str__(self) -> str:
        """Return the counts, for each value of what is in turn first."""
        return str(self.counts(self._first))

    @property
    def _first(self) -> str | None:
        """The name of what is in turn first, if there are not too many values to be counted."""
        few = (axis.name for axis in self.plan.in_turn if len(axis.labels) <= MOST_GROUPS)
        return next(few, None)

    def __repr__(self) -> str:
        """Return the counts, also where a notebook shows them as text."""
        return str(self)

    def _repr_html_(self) -> str:
        """Return the counts as a table for notebooks."""
        return self.counts(self._first)._repr_html_()

    @property
    def visible(self) -> Estimate | None:
        """The share of the starts that were drawn which would do; None if none were drawn."""
        tries = self._tries()
        return None if tries is None else estimate_share(*tries)

    def _tries(self) -> tuple[int, int] | None:
        runs, facts = self._facts
        if "start_tries" not in facts:
            return None
        _, draw, count = np.unique(runs // self.plan.cells, return_inverse=True, return_counts=True)
        will_do = np.bincount(draw, facts["began"].astype(float)) == count
        tries = np.zeros(len(count), dtype=np.int64)
        tries[draw] = facts["start_tries"]
        return int(will_do.sum()), int(tries.sum())

    def of_run(self, number: int) -> Experiment:
        """Return the experiment of one run, with its start and its noise; InputError: no run."""
        i = as_integer(number, "run", 0, self.plan.runs)
        rows = RowSimulator(self.plan)
        draw = np.array([i // self.plan.cells])
        q0, _, _ = rows.starts(draw)
        (part,) = rows.parts(np.array([i]))
        one = part.experiment.of_run(0) if part.experiment.varied else part.experiment
        return one.with_(start=q0[0], first_run=int(draw[0]), record="all")

    def replay(self, number: int) -> xr.Dataset:
        """Simulate one run again, with all instants; ReplayWarning if it ends otherwise.

        InputError: there is no such run.
        """
        one = self.of_run(number)
        run: xr.Dataset = one.run()
        at = np.flatnonzero(self.runs == number)
        for name in ("outcome", "end_time", "distance_to_goal", "path_length") if at.size else ():
            was, now = self._facts[1][name][at[0]], run[name].values
            if not np.array_equal(was, now, equal_nan=True):
                told = [_format_fact(name, value) for value in (was, now)]
                text = f"run {number} has another {name} now: {told[0]} became {told[1]}"
                warnings.warn(text, ReplayWarning, stacklevel=2)
                break
        return run

    def trajectories(self) -> xr.Dataset:
        """Return what a store has kept of the instants of the runs, read when it is used.

        InputError: nothing was kept.
        """
        if self.folder is None or not self.plan.trajectories:
            raise InputError("no trajectories were kept; give trajectories=1 and a store")
        return TrajectoryStore(self.folder / TRACKS).open(self.runs)

    def paired(
        self,
        by: str = "task",
        measure: str | None = "end_time",
        *,
        where: Mapping[str, Any] | None = None,
        level: float = 0.95,
    ) -> PairedComparison:
        """Return how the values of a name compare on the same draws; see `robsim.studies.paired_comparison`.

        McNemar's exact test, the difference of the shares that converged, and the median difference
        of a measure, with intervals. `where` are values of other columns, {name: value}, to which
        the runs are confined; where something else is in turn each needs one.
        """
        return compare_paired(self.rows(where), by, measure, level=level)

    def sensitivity(
        self, of: str = "converged", *, where: Mapping[str, Any] | None = None, **how: Any
    ) -> Sensitivity:
        """Return which varied numbers and choices matter most for a column, or for convergence.

        See `robsim.studies.sensitivity`; `where` is as in `compare_paired`.
        """
        return compute_sensitivity(self.rows(where), of, **how)

    def rows(self, where: Mapping[str, Any] | None = None) -> pd.DataFrame:
        """Return the rows of the table in which columns have these values; InputError: none has."""
        table = self.table
        for name, value in (where or {}).items():
            chosen = get_column(table, name) == value
            if not chosen.any():
                few = ", ".join(group_column(table, name, len(table)).labels[:10])
                raise InputError(f"no run has {name} = {format_value(value)}; there are: {few}")
            table = table[chosen]
        return table

    def worst(self, measure: str = "distance_to_goal", count: int = 10) -> pd.DataFrame:
        """Return the rows of the runs that began with the largest values of a column."""
        numbers = read_numbers(self.table, measure)
        table = self.table[self.table["began"] & np.isfinite(numbers)]
        return table.nlargest(as_integer(count, "count", 1), measure)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table as .parquet or .csv, or the counts as .tex; FileError: it cannot be."""
        suffix = Path(path).suffix if isinstance(path, str | os.PathLike) else ""
        if suffix == ".csv":
            return write_whole(path, self.table.to_csv(index=False))
        if suffix == ".tex":
            return write_whole(path, self.counts(self._first).latex())
        if suffix == ".parquet":
            return write_whole(path, encode_parquet(self.table))
        raise InputError(
            f"expected a name that ends in .parquet, .csv or .tex, got {format_value(path)}"
        )

    @property
    def text(self) -> str:
        """The TOML text of the study, for `robsim study`; InputError if it is Python code."""
        return format_plan(self.plan)

    @property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the hash of all rows, to the bit."""
        runs, facts = self._facts
        made = hashlib.sha256(np.asarray(runs, dtype=np.int64).tobytes())
        for name in sorted(facts):
            values = facts[name]
            made.update(name.encode() + np.ascontiguousarray(values).tobytes())
        return made.hexdigest()[:16]

    def converged(self) -> Estimate:
        """Return the share of the runs that converged, of those that began."""
        runs, facts = self._facts
        began, arrived = facts["began"], facts["outcome"] == Outcome.CONVERGED
        return estimate_clustered_share(arrived[began], runs[began] // self.plan.cells)


def _format_fact(name: str, value: Any) -> str:
    return Outcome(int(value)).name if name == "outcome" else repr(float(value))
