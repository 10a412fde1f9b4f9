"""The record of runs while they go on."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said
from robsim.base.room import room
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.kernels.outcomes import keeping

Record = Literal["all", "summary"] | int


class Judged(NamedTuple):
    """The rows of the outcome, of the ending of the experiment, and of the way of a run."""

    outcome: Rows
    ending: Rows
    length: Rows


class Track(NamedTuple):
    """Recorded instants, each (runs, instants, width)."""

    q: Array
    qd: Array
    rates: Array
    s: Array
    pixels: Array
    weights: Array


COPIES = 3  # of the results at once: those in memory, those in the file, and one on the way
SMALL = 5e7  # bytes, for which nobody asks how much is free
LONGEST = 10_000_000  # steps


def every(record: Record) -> int | None:
    """Return n if each n-th step is recorded; None for a summary. InputError: neither."""
    if isinstance(record, str):
        if record in ("all", "summary"):
            return 1 if record == "all" else None
    elif isinstance(record, int | np.integer) and record is not True and 1 <= record <= LONGEST:
        return int(record)
    raise InputError(f"record must be 'all', 'summary' or every n-th step, got {said(record)}")


class Recorder:
    """The recorded instants, and the end of each run; chunks write to rows of their own.

    `widths` are how many numbers there are of q, qd, rates, s, pixels and weights.
    """

    def __init__(self, runs: int, steps: int, record: Record, widths: tuple[int, ...]):
        self.every = every(record)
        instants = 0 if self.every is None else steps // self.every + 1
        _check_memory(runs, steps, self.every, widths)
        self.bounds = list(accumulate(widths, initial=0))
        width = self.bounds[-1]
        self.table = np.full((runs, instants, width), np.nan)
        self.ends = np.full((runs, width + 4), np.nan)  # and path length, ending, step, outcome

    @property
    def series(self) -> Track:
        """The recorded instants."""
        return self._parts(self.table)

    @property
    def last(self) -> Track:
        """The last instant of each run."""
        return self._parts(self.ends[:, None])

    @property
    def outcome(self) -> NDArray[np.int8]:
        """The outcome (runs,)."""
        found: NDArray[np.int8] = np.nan_to_num(self.ends[:, -1]).astype(np.int8)
        return found

    @property
    def end_step(self) -> Array:
        """The number of the last step (runs,)."""
        return self.ends[:, -2]

    @property
    def ending(self) -> NDArray[np.int8]:
        """The number (runs,) of the ending of the experiment that ended a run, or -1."""
        found: NDArray[np.int8] = np.nan_to_num(self.ends[:, -3], nan=-1.0).astype(np.int8)
        return found

    @property
    def path_length(self) -> Array:
        """The length (runs,) of the path in metres."""
        return self.ends[:, -4]

    def keep(self, program: Program, run: Rows, alive: Rows, kept: Sequence[Rows | None]) -> None:
        """Add the stage that keeps instants, with the rows of what is kept."""
        if self.every is not None:
            given = {"which": run, "alive": alive, "groups": _groups(kept)}
            table = program.address(self.table)
            program.add(keeping.keep, every=self.every, kept=table, **given)

    def end(
        self, program: Program, run: Rows, alive: Rows, kept: Sequence[Rows | None], judged: Judged
    ) -> None:
        """Add the stage that keeps the ends of runs."""
        groups = _groups([*kept, judged.length, judged.ending])
        given = {"which": run, "alive": alive, "outcome": judged.outcome, "groups": groups}
        program.add(keeping.end, kept=program.address(self.ends), **given)

    def stop(self, blocks: Blocks, step: int, kept: Sequence[Rows | None], judged: Judged) -> None:
        """Keep the last instant of runs that are stopped before their end."""
        runs = blocks.rows
        parts = [blocks.get(rows) for (rows,) in _groups([*kept, judged.length, judged.ending])]
        self.ends[runs, :-2] = np.concatenate(parts).T
        self.ends[runs, -2], self.ends[runs, -1] = step, 0.0

    def _parts(self, table: Array) -> Track:
        return Track(*(table[..., a:b] for a, b in pairwise(self.bounds)))


def _groups(kept: Sequence[Rows | None]) -> list[tuple[Rows]]:
    """Return the rows that there are, one after the other in each group."""
    return [(rows.flat,) for rows in kept if rows is not None and rows.size]


def _check_memory(runs: int, steps: int, every: int | None, widths: tuple[int, ...]) -> None:
    """Raise InputError if there is no room for the results of a record, before anything runs."""

    instants = 0 if every is None else steps // every + 1
    need, least = (_needed(runs, count, widths) for count in (instants, 0))
    if need <= SMALL or need <= (free := room()):
        return
    advice = "simulate fewer runs"
    if instants and least < free:
        fit = int((free - least) / (need - least) * instants)  # instants
        some = f"every n-th step (record={steps // fit + 1}) or " if fit else ""
        advice = f"record {some}the end only (record='summary'), fewer runs or a shorter time"
    raise InputError(
        f"{runs} runs with {instants} recorded instants need about {need / 1e9:.1f} GB, "
        f"and {free / 1e9:.1f} GB are free: {advice}"
    )


def _needed(runs: int, instants: int, widths: tuple[int, ...]) -> float:
    """Return how many bytes results take until they are saved, as measured.

    Of an instant there are what is recorded, the error (as wide as s) with its length and energy,
    a pose and a twist; of a run its start and its end, in images and in space.
    """
    width, k = sum(widths), widths[3]
    return 8.0 * COPIES * runs * (instants * (width + k + 24) + 3 * width + 60)
