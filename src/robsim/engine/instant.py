"""What a simulation is at one control instant, for those who go through it step by step."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, view_runs_first
from robsim.engine.chunk import Chunk
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome


@dataclass(frozen=True, eq=False)
class Instant:
    """One control instant of a single run, after its command and its judgement.

    step, time   number of the step, and seconds since the start
    q            coordinates (nq,)
    qd           velocities (nv,) commanded, or prescribed, for the period that begins
    qd_actual    velocities (nv,) of the joints, which follow the command with a lag or under limits
    s, error     features as measured, and their error (k,)
    pixels       true image (N, 2) of all marks
    outcome      why the run ends here, or RUNNING
    """

    step: int
    time: float
    q: Array
    qd: Array
    qd_actual: Array
    s: Array
    error: Array
    pixels: Array
    outcome: Outcome


def iterate_instants(loop: Loop) -> Iterator[Instant]:
    """Yield the instants of the single run of a loop."""
    for step, chunk in loop.instants(np.arange(1)):
        yield _make_instant(loop, step, chunk)


def _make_instant(loop: Loop, step: int, chunk: Chunk) -> Instant:
    seen = loop.sequence.snapshot(chunk)
    rates = seen.rates if len(seen.rates) else seen.qd
    arrays = seen.q, seen.qd, rates, seen.command.s, seen.command.error, seen.pixels
    outcome = Outcome(int(seen.outcome[0]))
    q, qd, actual, s, error, pixels = (view_runs_first(array)[0].copy() for array in arrays)
    return Instant(step, step * loop.dt, q, qd, actual, s, error, pixels, outcome)
