"""The recorder of runs."""

from __future__ import annotations

from itertools import accumulate, pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.free_memory import get_free_memory
from robsim.engine.outcome import Outcome
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.outcomes import history_tables

Record = Literal["all", "summary"] | int
RowGroups = list[tuple[BlockRows]]


class RecordedSeries(NamedTuple):
    """Recorded arrays, each (runs, instants, width)."""

    q: Array
    qd: Array
    rates: Array
    s: Array
    pixels: Array
    weights: Array
    hashes: Array
    factors: Array
    active: Array
    slack: Array
    torque: Array
    saturation: Array


COPIES = 3  # simultaneous copies of the results: in memory, in the file, and a temporary one
SMALL = 5e7  # bytes; below, free memory is not checked
LONGEST = 10_000_000  # steps


def parse_record(record: Record) -> int | None:
    """Return n if every n-th step is recorded, and None for a summary."""
    if isinstance(record, str):
        if record in ("all", "summary"):
            return 1 if record == "all" else None
    elif isinstance(record, int | np.integer) and record is not True and 1 <= record <= LONGEST:
        return int(record)
    raise InputError(
        f"record must be 'all', 'summary' or every n-th step, got {format_value(record)}"
    )


class Recorder:
    """Arrays of the recorded instants and of the end of each run.

    Each chunk writes to its own rows. `widths` are the numbers of columns of q, qd, rates, s,
    pixels, weights, hashes of pictures, factors of normal equations, active constraints, their
    slack, and the torques of drives and their saturation.
    """

    def __init__(self, runs: int, steps: int, record: Record, widths: tuple[int, ...]):
        self.every = parse_record(record)
        instants = 0 if self.every is None else steps // self.every + 1
        _check_record_memory(runs, steps, self.every, widths)
        self.bounds = list(accumulate(widths, initial=0))
        width = self.bounds[-1]
        self.table = np.full((runs, instants, width), np.nan)
        # the last instant of each run, with path length, ending, step, outcome
        self.ends = np.full((runs, width + 4), np.nan)

    @property
    def series(self) -> RecordedSeries:
        """The recorded instants."""
        return self._parts(self.table)

    @property
    def instants(self) -> int:
        """The number of recorded instants; after an interruption, of the simulated ones."""
        if self.every is None or (self.outcome != Outcome.RUNNING).all():
            return self.table.shape[1]
        return int(np.nanmax(self.end_step, initial=0.0)) // self.every + 1

    @property
    def last(self) -> RecordedSeries:
        """The last instant of each run."""
        return self._parts(self.ends[:, None])

    @property
    def outcome(self) -> NDArray[np.int8]:
        """The outcome (runs,)."""
        return _convert_codes(self.ends[:, -1], 0.0)

    @property
    def end_step(self) -> Array:
        """The number of the last step (runs,)."""
        return self.ends[:, -2]

    @property
    def ending(self) -> NDArray[np.int8]:
        """The index (runs,) of the ending that ended a run, or -1."""
        return _convert_codes(self.ends[:, -3], -1.0)

    @property
    def path_length(self) -> Array:
        """The path length (runs,) in metres."""
        return self.ends[:, -4]

    def keep(self, program: Program, run: BlockRows, alive: BlockRows, groups: RowGroups) -> None:
        """Add the stage that records instants, from the recorded rows."""
        if self.every is not None:
            rows = {"run": run, "alive": alive, "groups": groups}
            table = program.address(self.table)
            program.add(history_tables.record_instant, every=self.every, table=table, **rows)

    def end(
        self,
        program: Program,
        run: BlockRows,
        alive: BlockRows,
        outcome: BlockRows,
        groups: RowGroups,
    ) -> None:
        """Add the stage that records the ends of runs: recorded rows, path length and ending."""
        rows = {"run": run, "alive": alive, "outcome": outcome, "groups": groups}
        program.add(history_tables.record_ending, table=program.address(self.ends), **rows)

    def stop(self, blocks: Blocks, step: int, groups: RowGroups) -> None:
        """Record the last instant of runs that are stopped before their end, as `end` does."""
        runs = blocks.rows
        self.ends[runs, :-2] = np.concatenate([blocks.get(rows) for (rows,) in groups]).T
        self.ends[runs, -2], self.ends[runs, -1] = step, 0.0

    def _parts(self, table: Array) -> RecordedSeries:
        return RecordedSeries(*(table[..., a:b] for a, b in pairwise(self.bounds)))


def _convert_codes(numbers: Array, missing: float) -> NDArray[np.int8]:
    """Return numbers as integers, with another number for NaN."""
    codes: NDArray[np.int8] = np.where(np.isnan(numbers), missing, numbers).astype(np.int8)
    return codes


def group_rows(*kept: BlockRows | None) -> RowGroups:
    """Return rows as a stage of the record takes them; missing rows are left out."""
    return [(rows.flat,) for rows in kept if rows is not None and rows.size]


def _check_record_memory(runs: int, steps: int, every: int | None, widths: tuple[int, ...]) -> None:
    """Raise InputError if the results of a record do not fit into the free memory."""
    instants = 0 if every is None else steps // every + 1
    need, least = (_estimate_record_bytes(runs, count, widths) for count in (instants, 0))
    if need <= SMALL or need <= (free := get_free_memory()):
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


def _estimate_record_bytes(runs: int, instants: int, widths: tuple[int, ...]) -> float:
    """Return an estimate of the bytes of results until they are saved, from measurements.

    An instant stores the recorded numbers, the error (as many numbers as s), its norm, the Lyapunov
    function, a pose and a twist. A run stores its start and its end, in images and in space.
    """
    width, k = sum(widths), widths[3]
    return 8.0 * COPIES * runs * (instants * (width + k + 24) + 3 * width + 60)
