"""What is kept of the runs while they go on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array
from robsim.errors import InputError
from robsim.kernels import record as kernels

Record = Literal["all", "summary"] | int
MEMORY_BUDGET = 4e9  # bytes


def every(record: Record) -> int | None:
    """Of how many steps one is kept; None for a summary."""
    if record == "summary":
        return None
    if record == "all":
        return 1
    if isinstance(record, bool) or not isinstance(record, int | np.integer) or record < 1:
        raise InputError(f"record must be 'all', 'summary' or every n-th step, got {record!r}")
    return int(record)


@dataclass(frozen=True)
class Track:
    """Some moments of all runs, NaN where there is nothing: each (runs, moments, width)."""

    q: Array
    qd: Array
    s: Array
    pixels: Array

    @classmethod
    def empty(cls, runs: int, moments: int, widths: tuple[int, int, int, int]) -> Track:
        """Room for `widths` numbers of q, qd, s and pixels."""
        return cls(*(np.full((runs, moments, width), np.nan) for width in widths))

    def put(self, moment: int, rows: NDArray[np.int64], values: tuple[Array, ...]) -> None:
        """values[i][width, b] are those of run rows[b]."""
        kernels.store(rows, moment, *values, self.q, self.qd, self.s, self.pixels)


class Recorder:
    """The chosen moments, and for each run its end. Chunks write to rows of their own."""

    def __init__(self, runs: int, steps: int, record: Record, widths: tuple[int, int, int, int]):
        self.every = every(record)
        self.moments = 0 if self.every is None else steps // self.every + 1
        _check_memory(runs, self.moments, sum(widths))
        self.series = Track.empty(runs, self.moments, widths)
        self.last = Track.empty(runs, 1, widths)
        self.outcome = np.zeros(runs, dtype=np.int8)
        self.end_step = np.full(runs, np.nan)
        self.path_length = np.full(runs, np.nan)

    def moment(self, step: int, rows: NDArray[np.int64], values: tuple[Array, ...]) -> None:
        """Keep a step if it was asked for."""
        if self.every is not None and step % self.every == 0:
            self.series.put(step // self.every, rows, values)

    def end(
        self,
        step: int,
        rows: NDArray[np.int64],
        values: tuple[Array, ...],
        outcome: NDArray[np.int8],
        length: Array,
    ) -> None:
        """Keep how these runs ended."""
        self.last.put(0, rows, values)
        self.outcome[rows], self.end_step[rows], self.path_length[rows] = outcome, step, length


def _check_memory(runs: int, moments: int, width: int) -> None:
    """Refuse before anything runs; poses, velocities and errors come on top of what is stored."""
    estimate = 8.0 * runs * (moments + 1) * (2 * width + 32)
    if estimate > MEMORY_BUDGET:
        raise InputError(
            f"{runs} runs with {moments} recorded moments need about {estimate / 1e9:.1f} GB, more "
            f"than {MEMORY_BUDGET / 1e9:.0f} GB: record every n-th step (record=n) or the end only "
            "(record='summary')"
        )
