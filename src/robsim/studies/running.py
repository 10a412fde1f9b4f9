"""The simulation of a plan, some runs at a time, into memory or a store."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robsim.base import interrupt
from robsim.base.errors import InputError
from robsim.base.room import room
from robsim.studies.columns import BYTES, MORE_BYTES, Columns, nothing
from robsim.studies.plan import Plan
from robsim.studies.rows import Done, Rows, Stopped
from robsim.studies.store import Store

Progress = Callable[[float], None]
CHECKED = 32  # draws, and combinations of what is in turn, that are tried before anything runs
Chunk = tuple[int, int]  # runs from one until before another


@dataclass(eq=False)
class Memory:
    """Rows in memory: one array for each column."""

    runs: int
    measures: bool = False
    done: Any = field(init=False)
    columns: Columns = field(default_factory=dict)

    def __post_init__(self) -> None:
        need, free = self.runs * (BYTES + MORE_BYTES * self.measures), room()
        if need > free:
            raise InputError(
                f"{self.runs} runs need about {need / 1e9:.3g} GB of memory, and "
                f"{free / 1e9:.3g} GB are free: fewer runs, or a store on disk (store=folder, -o)"
            )
        self.done = np.zeros(self.runs, dtype=bool)

    def missing(self, runs: int) -> Iterator[Chunk]:
        """Yield all runs."""
        yield 0, runs

    def put(self, plan: Plan, first: int, last: int, found: Done) -> None:
        """Keep what came out of some runs."""
        for name, values in found.facts.items():
            if name not in self.columns:
                self.columns[name] = np.empty(self.runs, dtype=values.dtype)
            self.columns[name][first:last] = values
        self.done[first:last] = True

    def facts(self, plan: Plan) -> tuple[Any, Columns]:
        """Return the numbers of the runs that are there, and what came out of them."""
        if self.done.all():
            return np.arange(self.runs), self.columns
        columns = self.columns or nothing(plan)
        return np.flatnonzero(self.done), {n: x[self.done[: len(x)]] for n, x in columns.items()}


Sink = Memory | Store  # where the rows of a study go


def chunks(sink: Sink, plan: Plan, size: int) -> Iterator[Chunk]:
    """Yield the runs that are missing, some at a time."""
    for first, last in sink.missing(plan.runs):
        for begin in range(first, last, size):
            yield begin, min(begin + size, last)


def simulate(
    plan: Plan, sink: Sink, size: int, threads: int | None, progress: Progress | None
) -> bool:
    """Simulate what is missing on this machine; return False if a stop came before the end."""
    rows, finished = Rows(plan, threads), done(sink, plan)
    with interrupt.held() as stops:
        for first, last in chunks(sink, plan, size):
            try:
                found = rows.done(first, last)
            except Stopped:
                return False
            sink.put(plan, first, last, found)
            finished += last - first
            if progress:
                progress(finished / plan.runs)
            if stops:
                return finished == plan.runs
    return True


def done(sink: Sink, plan: Plan) -> int:
    """Return how many runs have their rows already."""
    return plan.runs - sum(last - first for first, last in sink.missing(plan.runs))


def check(plan: Plan) -> None:
    """Raise InputError if what is in turn is refused, or no start of the first draws will do."""
    rows = Rows(plan)
    cells = [plan.cells_of([axis.name])[:CHECKED] for axis in plan.in_turn]
    for part in rows.parts(np.unique(np.concatenate([plan.cells_of([]), *cells]))):
        part.experiment.check(view=False)
    if plan.start is None:
        return
    draws = np.arange(min(plan.draws, CHECKED))
    _, tries, will_do = rows.starts(draws)
    if not will_do.any() and plan.start.visible:
        raise InputError(
            f"start: of {tries.sum()} starts that were drawn none is reached and sees its target "
            "from within the limits of the joints; try another distance or cone, a larger image, "
            "or visible=False to see why"
        )
