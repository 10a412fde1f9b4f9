"""`StudyResult`: the results of many runs, as a table, as counts and as statistics."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
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
from robsim.studies.row_files import encode_parquet
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.sensitivity import Sensitivity, compute_sensitivity
from robsim.studies.study_plan import Codes, Plan
from robsim.studies.study_store import StudyStore
from robsim.studies.study_text import format_plan
from robsim.studies.table_columns import Among, get_column, group_column, read_numbers


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult:
    """Runs of a study as a table with a row for each run, and the plan that reproduces them.

    `study` and `open_study` return it. `str` and `print` show the counted outcomes with intervals.

    Attributes
    ----------
    plan : Plan
        The plan of the study.
    folder : Path or None
        Folder of the store, if any.
    table : DataFrame
        Number of the run and of its draw, varied values, start (m, rad), and results; see
        `robsim.studies.result_columns.COLUMN_MEANINGS`. Runs with `began` false are not counted: at
        their start the target is not seen, or a joint is beyond its limits.

    Examples
    --------
    >>> import robsim as rs
    >>> one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=8)
    >>> result = rs.study(one, 4, vary={"task.gain": rs.samplers.Uniform(1, 2)})
    >>> result.complete, len(result.table), str(result.converged())
    (True, 4, '75.0 % [30.1, 95.4]')
    """

    plan: Plan
    _read: Callable[[], tuple[Codes, Columns]] = field(repr=False)
    folder: Path | None = None

    @property
    def experiment(self) -> Experiment:
        """The experiment that is varied."""
        return self.plan.experiment

    @property
    def complete(self) -> bool:
        """Whether all runs of the plan are finished."""
        return len(self.runs) == self.plan.runs

    @cached_property
    def _facts(self) -> tuple[Codes, Columns]:
        """The numbers of the finished runs, and their columns."""
        return self._read()

    @property
    def runs(self) -> Codes:
        """The numbers (n,) of the finished runs."""
        return self._facts[0]

    @cached_property
    def table(self) -> pd.DataFrame:
        """The table with a row for each run; see the class."""
        need, free = len(self.runs) * TABLE_BYTES, get_free_memory()
        if need > free:
            raise InputError(
                f"a table of {len(self.runs)} runs needs about {need / 1e9:.3g} GB, and "
                f"{free / 1e9:.3g} GB are free; read the Parquet files of the store in parts"
            )
        return make_table(self.plan, *self._facts)

    def counts(self, by: str | None = None) -> OutcomeCounts:
        """Return the counted outcomes with intervals, in total or for each value of a column.

        Parameters
        ----------
        by : str, optional
            Column to group the runs by.

        Returns
        -------
        OutcomeCounts
            Counts and shares; printed as a table.
        """
        return count_outcomes(self.table, by, self._tries(), self.plan.runs)

    def __str__(self) -> str:
        """Return the counts, by the values of the first enumerated name."""
        return str(self.counts(self._first))

    @property
    def _first(self) -> str | None:
        """The first enumerated name with at most `MOST_GROUPS` values."""
        few = (axis.name for axis in self.plan.in_turn if len(axis.labels) <= MOST_GROUPS)
        return next(few, None)

    def __repr__(self) -> str:
        """Return the counts; notebooks show them as text."""
        return str(self)

    def _repr_html_(self) -> str:
        """Return the counts as a table for notebooks."""
        return self.counts(self._first)._repr_html_()

    @property
    def visible(self) -> Estimate | None:
        """The share of accepted random starts; None if the study has no random starts."""
        tries = self._tries()
        return None if tries is None else estimate_share(*tries)

    def _tries(self) -> tuple[int, int] | None:
        """Return the number of accepted starts and of all attempts; None without random starts."""
        runs, facts = self._facts
        if "start_tries" not in facts:
            return None
        _, draw, count = np.unique(runs // self.plan.cells, return_inverse=True, return_counts=True)
        accepted = np.bincount(draw, facts["began"].astype(float)) == count
        tries = np.zeros(len(count), dtype=np.int64)
        tries[draw] = facts["start_tries"]
        return int(accepted.sum()), int(tries.sum())

    def of_run(self, number: int) -> Experiment:
        """Return the experiment of one run, with its start and its noise.

        Parameters
        ----------
        number : int
            Number of the run.

        Raises
        ------
        InputError
            If the run does not exist.
        """
        i = as_integer(number, "run", 0, self.plan.runs)
        rows = RowSimulator(self.plan)
        draw = np.array([i // self.plan.cells])
        q0, _, _ = rows.starts(draw)
        (part,) = rows.parts(np.array([i]))
        one = part.experiment.of_run(0) if part.experiment.varied else part.experiment
        return one.with_(start=q0[0], first_run=int(draw[0]), record="all")

    def replay(self, number: int) -> xr.Dataset:
        """Simulate one run again with all instants.

        Parameters
        ----------
        number : int
            Number of the run.

        Returns
        -------
        Dataset
            The run.

        Raises
        ------
        InputError
            If the run does not exist.

        Warns
        -----
        ReplayWarning
            If the new run has another outcome, end time, final distance or path length.
        """
        one = self.of_run(number)
        run: xr.Dataset = one.run()
        at = np.flatnonzero(self.runs == number)
        for name in ("outcome", "end_time", "distance_to_goal", "path_length") if at.size else ():
            was, now = self._facts[1][name][at[0]], run[name].values
            if not np.array_equal(was, now, equal_nan=True):
                texts = [_format_fact(name, value) for value in (was, now)]
                text = f"run {number} has another {name} now: {texts[0]} became {texts[1]}"
                warnings.warn(text, ReplayWarning, stacklevel=2)
                break
        return run

    def trajectories(self) -> xr.Dataset:
        """Return the stored instants of the runs, which are read on demand.

        Returns
        -------
        Dataset
            Coordinates, velocities and norm of the error over run and time.

        Raises
        ------
        InputError
            If the study stores no trajectories.
        """
        if self.folder is None or not self.plan.trajectories:
            raise InputError("no trajectories were stored; give trajectories=1 and a store")
        return StudyStore(self.folder).trajectories(self.plan).sel(run=self.runs)

    def paired(
        self,
        by: str = "task",
        measure: str | None = "end_time",
        *,
        where: Mapping[str, object] | None = None,
        level: float = 0.95,
    ) -> PairedComparison:
        """Compare the values of a column on the same draws; see `robsim.studies.paired_comparison`.

        Each pair of values has McNemar's exact test, the difference of the converged shares, and
        the median difference of a measure, with intervals.

        Parameters
        ----------
        by : str, default "task"
            Column with the compared values.
        measure : str or None, default "end_time"
            Column of numbers for the median difference.
        where : mapping of str to object, optional
            Values of other columns that select runs. Needed if other names are enumerated.
        level : float, default 0.95
            Level of the intervals.

        Returns
        -------
        PairedComparison
            The comparisons; printed as a table.
        """
        return compare_paired(self.rows(where), by, measure, level=level)

    def sensitivity(
        self,
        of: str = "converged",
        *,
        where: Mapping[str, object] | None = None,
        names: Sequence[str] | str | None = None,
        among: Among | None = None,
        level: float = 0.95,
    ) -> Sensitivity:
        """Return the dependence of convergence or of a measure on each varied number and choice.

        Parameters
        ----------
        of : str, default "converged"
            "converged", or a column of numbers.
        where : mapping of str to object, optional
            Values of other columns that select runs.
        names : str or sequence of str, optional
            Columns to examine. Default: the varied names, and the start's distance and angle from
            the goal.
        among : {"converged", "began"}, optional
            Runs that count. Default for measures: the converged runs.
        level : float, default 0.95
            Level of the intervals.

        Returns
        -------
        Sensitivity
            Correlation measures, largest first; printed as a table.
        """
        return compute_sensitivity(self.rows(where), of, names, among=among, level=level)

    def rows(self, where: Mapping[str, object] | None = None) -> pd.DataFrame:
        """Return the rows of the table with the given values in other columns.

        Parameters
        ----------
        where : mapping of str to object, optional
            Required values by column. Default: all rows.

        Returns
        -------
        DataFrame
            The selected rows.

        Raises
        ------
        InputError
            If a column does not exist, or no row has the values.
        """
        table = self.table
        for name, value in (where or {}).items():
            selected = get_column(table, name) == value
            if not selected.any():
                examples = ", ".join(group_column(table, name, len(table)).labels[:10])
                raise InputError(
                    f"no run has {name} = {format_value(value)}; there are: {examples}"
                )
            table = table[selected]
        return table

    def worst(self, measure: str = "distance_to_goal", count: int = 10) -> pd.DataFrame:
        """Return the runs with the largest values of a column, among the runs that began.

        Parameters
        ----------
        measure : str, default "distance_to_goal"
            Column of numbers.
        count : int, default 10
            Largest number of rows.

        Returns
        -------
        DataFrame
            Rows of the table in descending order of the column.
        """
        numbers = read_numbers(self.table, measure)
        table = self.table[self.table["began"] & np.isfinite(numbers)]
        return table.nlargest(as_integer(count, "count", 1), measure)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the table or the counts to a file.

        Parameters
        ----------
        path : path-like
            File name that ends in .parquet or .csv (the table), or .tex (the counts).

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            If the file name has another ending.
        FileError
            If the file cannot be written.
        """
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
        """The TOML text of the study, for `robsim study`.

        Raises InputError if the study contains Python code.
        """
        return format_plan(self.plan)

    @property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of a hash of the text and all rows, to the bit.

        A study with Python code has no text; its hash includes its seed and its varied names.
        Stored trajectories do not change the hash.
        """
        runs, facts = self._facts
        try:
            text = format_plan(replace(self.plan, trajectories=None))
        except InputError:
            text = f"{self.plan}, seed {self.plan.seed}"
        digest = hashlib.sha256(text.encode() + np.asarray(runs, dtype=np.int64).tobytes())
        for name in sorted(facts):
            values = facts[name]
            if values.dtype.kind == "f":  # Parquet keeps neither sign nor payload of a NaN
                values = np.where(np.isnan(values), np.nan, values)
            digest.update(name.encode() + np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()[:16]

    def converged(self) -> Estimate:
        """Return the share of converged runs among the runs that began."""
        runs, facts = self._facts
        began, has_converged = facts["began"], facts["outcome"] == Outcome.CONVERGED
        return estimate_clustered_share(has_converged[began], runs[began] // self.plan.cells)


def _format_fact(name: str, value: Any) -> str:
    """Return a value of a column as text, an outcome by its name."""
    return Outcome(int(value)).name if name == "outcome" else repr(float(value))
