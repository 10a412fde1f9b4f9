"""The state of a single run at one control instant, for stepwise simulation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from robsim.base.arrays import Array, view_runs_first
from robsim.engine.chunk import Chunk
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.kernels.machine.block_rows import BlockRows


@dataclass(frozen=True, eq=False)
class Instant:
    """State of a single run at a control instant, after the command.

    `Experiment.steps` yields instants.

    Attributes
    ----------
    step : int
        Number of the step.
    time : float
        Seconds since the start.
    q : ndarray of shape (nq,)
        Coordinates.
    qd : ndarray of shape (nv,)
        Velocities for the period that begins, commanded or prescribed.
    qd_actual : ndarray of shape (nv,)
        Velocities of the joints, which follow the command with a lag or under limits.
    s, error : ndarray of shape (k,)
        Measured features, and their error.
    pixels : ndarray of shape (N, 2)
        True image coordinates of all marks.
    outcome : Outcome
        Outcome of the run if it ends here, or RUNNING.
    active, slack : ndarray of shape (c,)
        Multiplier of each constraint of the law, and the excess over it; as in the record of a run.
    torque, saturation : ndarray of shape (nv,)
        Torques of drives, and the share of the last period in which they were limited; empty
        without a drive.
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
    active: Array
    slack: Array
    torque: Array = field(default_factory=lambda: np.empty(0))
    saturation: Array = field(default_factory=lambda: np.empty(0))


def iterate_instants(loop: Loop) -> Iterator[Instant]:
    """Yield the instants of the single run of a loop."""
    for step, chunk in loop.instants(np.arange(1)):
        yield make_instant(loop, step, chunk)


def make_instant(loop: Loop, step: int, chunk: Chunk) -> Instant:
    """Return the state of the single run of a loop at a step."""
    seen = loop.sequence.snapshot(chunk)
    rates = seen.rates if len(seen.rates) else seen.qd
    arrays = seen.q, seen.qd, rates, seen.command.s, seen.command.error, seen.pixels
    outcome = Outcome(int(seen.outcome[0]))
    q, qd, actual, s, error, pixels = (view_runs_first(array)[0].copy() for array in arrays)
    command = loop.sequence.command
    torques = loop.sequence.plant.torques
    held = (chunk.first(rows).copy() for rows in torques)
    constraints = (_copy_rows_of_run(chunk, rows) for rows in (command.active, command.slack))
    more = *constraints, *held
    return Instant(step, step * loop.dt, q, qd, actual, s, error, pixels, outcome, *more)


def _copy_rows_of_run(chunk: Chunk, rows: BlockRows | None) -> Array:
    """Return a copy of rows (n,) of the single run of a chunk; empty if there are none."""
    return np.empty(0) if rows is None else chunk.first(rows)
