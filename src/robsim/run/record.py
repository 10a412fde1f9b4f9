"""The record of runs while they go on."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, some_runs
from robsim.base.errors import InputError
from robsim.kernels import record as kernels
from robsim.kernels.record import Track
from robsim.run.snapshot import Snapshot

Record = Literal["all", "summary"] | int
MEMORY_BUDGET = 4e9  # bytes
LONGEST = 10_000_000  # steps


def every(record: Record) -> int | None:
    """Return n if each n-th step is recorded; None for a summary. InputError: neither."""
    if isinstance(record, str):
        if record in ("all", "summary"):
            return 1 if record == "all" else None
    elif isinstance(record, int | np.integer) and record is not True and 1 <= record <= LONGEST:
        return int(record)
    raise InputError(f"record must be 'all', 'summary' or every n-th step, got {record!r:.80}")


def _empty(runs: int, instants: int, widths: tuple[int, ...]) -> Track:
    """Return room for `widths` numbers of q, qd, rates, s and pixels, filled with NaN."""
    return Track(*(np.full((runs, instants, width), np.nan) for width in widths))


class Recorder:
    """The recorded instants, and the end of each run; chunks write to rows of their own."""

    def __init__(self, runs: int, steps: int, record: Record, widths: tuple[int, ...]):
        self.every = every(record)
        instants = 0 if self.every is None else steps // self.every + 1
        _check_memory(runs, instants, sum(widths))
        self.series = _empty(runs, instants, widths)
        self.last = _empty(runs, 1, widths)
        self.outcome = np.zeros(runs, dtype=np.int8)
        self.end_step = np.full(runs, np.nan)
        self.path_length = np.full(runs, np.nan)

    def end(
        self,
        step: int,
        rows: NDArray[np.int64],
        snapshot: Snapshot,
        length: Array,
        over: NDArray[np.bool_],
    ) -> None:
        """Keep the ends of those runs that are over."""
        values = (
            snapshot.q,
            snapshot.qd,
            snapshot.rates,
            snapshot.command.s,
            snapshot.pixels,
        )
        ended = (some_runs(value, over) for value in values)
        kernels.store(rows[over], 0, *ended, self.last)
        self.outcome[rows[over]] = snapshot.outcome[over]
        self.end_step[rows[over]], self.path_length[rows[over]] = step, length[over]


def _check_memory(runs: int, instants: int, width: int) -> None:
    """Raise InputError if a record would be too large, before anything runs.

    Poses, velocities and errors come on top of what is stored.
    """
    estimate = 8.0 * runs * (instants + 1) * (2 * width + 32)
    if estimate > MEMORY_BUDGET:
        raise InputError(
            f"{runs} runs with {instants} recorded instants need about {estimate / 1e9:.1f} GB, "
            f"more than {MEMORY_BUDGET / 1e9:.0f} GB: record every n-th step (record=n) or the end "
            "only (record='summary')"
        )
