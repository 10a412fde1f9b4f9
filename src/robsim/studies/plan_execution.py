"""Simulation of a plan, some runs at a time, into memory or a store."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from robsim.base import interrupt
from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.free_memory import get_free_memory
from robsim.studies.result_columns import MEASURE_BYTES, RUN_BYTES, Columns, empty_columns
from robsim.studies.row_simulator import ChunkResult, RowSimulator, StopRequest
from robsim.studies.study_plan import Codes, Plan
from robsim.studies.study_store import StudyStore

Progress = Callable[[float], None]
SAME_START = 1e-6  # metres and radians; nearer starts are the same
CHECKED_STARTS = 32  # draws and combinations of values that are checked before the simulation
Chunk = tuple[int, int]  # first run, and last run (exclusive)


@dataclass(eq=False)
class MemorySink:
    """Results in memory: one array for each column."""

    runs: int
    measures: bool = False
    done: NDArray[np.bool_] = field(init=False)
    columns: Columns = field(default_factory=dict)

    def __post_init__(self) -> None:
        need, free = self.runs * (RUN_BYTES + MEASURE_BYTES * self.measures), get_free_memory()
        if need > free:
            raise InputError(
                f"{self.runs} runs need about {need / 1e9:.3g} GB of memory, and "
                f"{free / 1e9:.3g} GB are free: fewer runs, or a store on disk (store=folder, -o)"
            )
        self.done = np.zeros(self.runs, dtype=bool)

    def missing(self, runs: int) -> Iterator[Chunk]:
        """Yield all runs."""
        yield 0, runs

    def put(self, plan: Plan, first: int, last: int, result: ChunkResult) -> None:
        """Store the results of some runs."""
        for name, values in result.facts.items():
            if name not in self.columns:
                self.columns[name] = np.empty(self.runs, dtype=values.dtype)
            self.columns[name][first:last] = values
        self.done[first:last] = True

    def facts(self, plan: Plan) -> tuple[Codes, Columns]:
        """Return the numbers of the finished runs, and their columns."""
        if self.done.all():
            return np.arange(self.runs), self.columns
        columns = self.columns or empty_columns(plan)
        return np.flatnonzero(self.done), {n: x[self.done[: len(x)]] for n, x in columns.items()}


StudySink = MemorySink | StudyStore  # destination of the rows of a study


def generate_chunks(sink: StudySink, plan: Plan, size: int) -> Iterator[Chunk]:
    """Yield the missing runs, some at a time."""
    for first, last in sink.missing(plan.runs):
        for begin in range(first, last, size):
            yield begin, min(begin + size, last)


def simulate_plan(
    plan: Plan, sink: StudySink, size: int, threads: int | None, progress: Progress | None
) -> bool:
    """Simulate the missing runs on this machine; return False after a stop."""
    rows, finished = RowSimulator(plan, threads), count_done(sink, plan)
    with interrupt.defer_stops() as stops:
        for first, last in generate_chunks(sink, plan, size):
            try:
                result = rows.simulate(first, last)
            except StopRequest:
                return False
            sink.put(plan, first, last, result)
            finished += last - first
            if progress:
                progress(finished / plan.runs)
            if stops:
                return finished == plan.runs
    return True


def count_done(sink: StudySink, plan: Plan) -> int:
    """Return the number of finished runs."""
    return plan.runs - sum(last - first for first, last in sink.missing(plan.runs))


def check_plan(plan: Plan) -> None:
    """Raise InputError if an enumerated value is invalid, or all first starts are rejected."""
    rows = RowSimulator(plan)
    cells = [plan.cells_of([axis.name])[:CHECKED_STARTS] for axis in plan.in_turn]
    for part in rows.parts(np.unique(np.concatenate([plan.cells_of([]), *cells]))):
        part.experiment.check(view=False)
    if plan.start is None:
        return
    draws = np.arange(min(plan.draws, CHECKED_STARTS))
    q, tries, accepted = rows.starts(draws)
    if plan.start.numbers and not rows.reach.reaches_every_pose:
        _check_variety(rows, q[accepted])
    if not accepted.any() and plan.start.visible:
        raise InputError(
            f"start: none of {tries.sum()} random starts is accepted: {rows.describe_rejections()}"
        )


def _check_variety(rows: RowSimulator, q: Array) -> None:
    """Raise InputError if several starts (n, nq) of a robot with few joints are the same."""
    if len(q) > 1 and np.ptp(q, axis=0).max() < SAME_START:
        raise InputError(
            f"start: {rows.reach.joints_text} leave one start, {format_value(q[0].tolist())}: give "
            "it as an array, or sample coordinates by rs.samplers.Uniform(low, high); LookAt(..., "
            "aside=) looks beside the target"
        )
