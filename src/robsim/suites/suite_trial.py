"""A trial: all runs of a scheme in a suite, as rows."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from robsim.analysis.compared_scheme import scale_progress
from robsim.base.errors import InputError, Interrupted, RankWarning
from robsim.engine.outcome import Outcome
from robsim.engine.workers import Progress
from robsim.run.end_variables import is_valid_start
from robsim.run.experiment import Experiment
from robsim.servo.tasks.task import Task
from robsim.suites.builtin_schemes import convert_user_errors
from robsim.suites.suite import Suite

KEPT_VARIABLES = "outcome", "end_time", "path_length", "q0", "q_end"  # stored variables of runs


@dataclass(frozen=True, eq=False)
class Trial:
    """A scheme in a suite: its task, and arguments for threads and chunk."""

    suite: Suite
    scheme: str
    task: Task
    how: Mapping[str, Any]

    @property
    def subject(self) -> str:
        """The subject of error messages."""
        return f"scheme '{self.scheme}' in suite '{self.suite.name}'"

    @cached_property
    def experiments(self) -> list[Experiment]:
        """The experiment of all runs, or of each run if one experiment cannot vary the numbers."""
        whole = self.suite.experiment(self.task)
        if not self.varied:
            return [whole]
        try:
            return [whole.vary(self.varied)]
        except InputError:
            return [self._single(whole, i) for i in range(self.suite.runs)]

    def _single(self, whole: Experiment, i: int) -> Experiment:
        """Return the experiment of one run."""
        one = whole.with_(start=np.asarray(self.suite.starts)[i : i + 1], first_run=i)
        return one.at({name: np.asarray(values[i]) for name, values in self.varied.items()})

    @property
    def varied(self) -> dict[str, Any]:
        """The values that differ from run to run, except fields that this task lacks."""
        varied = dict(self.suite.varied)
        if not getattr(self.task, "needs_depth", True):
            varied.pop("task.depth_scale", None)
        return varied

    def check(self) -> None:
        """Bind the task as a run does; InputError names the scheme."""
        with convert_user_errors(self.subject), warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)  # the run gives the warning
            self.experiments[0].check(view=False)

    def rows(self, progress: Progress | None) -> pd.DataFrame:
        """Return a row for each run; Interrupted carries the rows of the finished runs."""
        parts: list[dict[str, Any]] = []
        count = len(self.experiments)
        for i, one in enumerate(self.experiments):
            try:
                with convert_user_errors(self.subject):
                    run = one.run(scale_progress(progress, i / count, 1 / count), **self.how)
            except Interrupted as stop:
                raise Interrupted(
                    str(stop), self._table([*parts, _select_kept(stop.run)])
                ) from None
            parts.append(_select_kept(run))
        return self._table(parts)

    def _table(self, parts: list[dict[str, Any]]) -> pd.DataFrame:
        """Return the rows of finished runs."""
        ends = {
            key: np.concatenate([part[key] for part in parts]) for key in (*KEPT_VARIABLES, "began")
        }
        suite, runs = self.suite, np.arange(len(ends["outcome"]))
        rows = pd.DataFrame({"suite": suite.name, "version": suite.version, "run": runs})
        rows.insert(2, "scheme", self.scheme)
        draws = _number_equal_runs(ends) if suite.draws is None else np.asarray(suite.draws)[runs]
        rows["draw"] = draws
        for name, values in {**suite.groups, **suite.columns}.items():
            rows[name] = np.asarray(values)[: len(rows)]
        rows["outcome"] = [Outcome(int(each)).words for each in ends["outcome"]]
        rows["began"] = ends["began"]
        rows["time"], rows["path_length"] = ends["end_time"], ends["path_length"]
        for when, q in (("at_start", ends["q0"]), ("to_goal", ends["q_end"])):
            rows[f"distance_{when}"], rows[f"angle_{when}"] = suite.off_goal(q)
        rows.insert(rows.columns.get_loc("began") + 1, "success", self._successes(rows))
        finished = ends["outcome"] != Outcome.RUNNING
        return rows[finished].reset_index(drop=True)

    def _successes(self, rows: pd.DataFrame) -> NDArray[np.bool_]:
        """Return which runs began and succeeded; InputError if the criterion is invalid."""
        with convert_user_errors(f"succeeds of suite '{self.suite.name}'"):
            succeeded = np.asarray(self.suite.succeeds(rows))
        if succeeded.shape != (len(rows),) or succeeded.dtype != np.bool_:
            raise InputError(
                f"succeeds of suite '{self.suite.name}': expected truth values of shape "
                f"({len(rows)},), got {succeeded.dtype} of shape {succeeded.shape}"
            )
        return np.asarray(succeeded & rows["began"].to_numpy())


def _number_equal_runs(ends: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Return for each run (runs,) the first run that has the same start, end and time."""
    table = np.column_stack([ends["q0"], ends["q_end"], ends["end_time"], ends["outcome"]])
    first: dict[bytes, int] = {}
    return np.array([first.setdefault((row + 0.0).tobytes(), i) for i, row in enumerate(table)])


def _select_kept(run: xr.Dataset) -> dict[str, Any]:
    """Return the stored variables of runs."""
    return {
        "began": is_valid_start(run["outcome"].values, run["end_time"].values),
        **{key: run[key].values for key in KEPT_VARIABLES},
    }
