"""The simulation loop, in which the runs of a chunk advance in lockstep, whatever the task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, runs_last, some_runs
from robsim.kernels import loop as kernels
from robsim.kernels.endings import Watch
from robsim.kernels.jit import is_cold
from robsim.kernels.loop import Command, Noise, Scheme
from robsim.kernels.sight import Projection
from robsim.robot.joint import LIMIT_SLACK
from robsim.run.chunk import Chunk
from robsim.run.drives import Drives, Period
from robsim.run.images import ImageStream, check_sensing
from robsim.run.outcome import Outcome
from robsim.run.record import Record, Recorder
from robsim.run.snapshot import Snapshot
from robsim.servo.controller import Controller, Decision
from robsim.servo.laws.inverse import product, rank
from robsim.servo.measurement import Measurement
from robsim.servo.sight import Key, joined
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

LEAST_STEPS = 1000  # steps of runs; compiling the whole loop for fewer costs more than it saves
BURST = 100_000  # steps of runs that go on in compiled code before Ctrl-C is looked for


OnStep = Callable[[Snapshot, Decision], None]  # called after every step


def worth_compiling(runs: int, steps: float) -> bool:
    """Return whether to use the compiled loop, which gives the same bits and may save time."""
    there = getattr(kernels.stride, "overloads", ()) or not is_cold("loop.stride")
    return bool(there) or runs * steps >= LEAST_STEPS


@dataclass
class Loop:
    """The constants of a simulation, its record, and whether to stop, which all chunks share."""

    controller: Controller
    q0: Array  # (runs, nq)
    dt: float
    steps: int
    seed: int = 0
    sensing: Sensing = field(default_factory=Sensing)
    actuation: Actuation = field(default_factory=Actuation)
    hold: bool = False
    first_run: int = 0
    record: Record = "summary"
    single: bool = False  # whether one start was given, not a batch of one
    on_step: OnStep | None = None
    stopped: bool = field(default=False, init=False)
    recorder: Recorder = field(init=False)

    def __post_init__(self) -> None:
        controller, scene = self.controller, self.scene
        check_sensing(self.sensing, controller.sights, self.dt)
        self.actuation.check(scene.velocity_names, scene.coordinate_names)
        self.drives = Drives(self.actuation, scene, controller.columns)
        rates = scene.nv if self.drives.moves else 0
        widths = (scene.nq, scene.nv, rates, controller.k, controller.goal_pixels.size)
        self.recorder = Recorder(len(self.q0), self.steps, self.record, widths)
        slack = np.array([-LIMIT_SLACK, LIMIT_SLACK])
        self.limits: Array = np.ascontiguousarray(scene.limits + slack)
        self.steady = not any(callable(motion.rates) for motion in scene.motions)
        self.still = scene.drift(0.0)
        self.prompt = self.sensing.only_noise and not self.actuation.counts
        self.rows = self._rows()
        self.scheme = self._scheme()
        self.moves = controller.sights[0].moves(controller.columns) if self.scheme else None

    def _rows(self) -> list[slice]:
        """Return the rows of the pixels of each sight."""
        counts = [len(sight.target.marks) for sight in self.controller.sights]
        return [slice(*pair) for pair in pairwise(np.cumsum([0, *counts]).tolist())]

    def _scheme(self) -> Scheme | None:
        """Return the scheme for the compiled loop; None if it cannot run this, or saves no time."""
        usual = self.steady and self.prompt and self.scene.tree.compiled
        plain = usual and not (self.drives.moves or self.on_step)
        scheme = self.controller.compiled if plain else None
        return scheme if scheme and worth_compiling(len(self.q0), self.steps) else None

    @property
    def scene(self) -> Scene:
        """The true scene."""
        return self.controller.scene

    def advance(self, rows: NDArray[np.int64], done: Callable[[float], None]) -> None:
        """Simulate a chunk of runs from start to end, in lockstep."""
        step, chunk = 0, self._chunk(rows)
        go_on = _stride if self.scheme else _step
        while not self.stopped or step:  # a chunk that has begun is left at a recorded instant
            step, snapshot = go_on(self, chunk, step)
            over = (snapshot.outcome > 0) | self.stopped
            period = Period(chunk.q, chunk.rates, snapshot.qd)
            if over.any():
                _mark_singular(self.controller, snapshot)
                self.recorder.end(step, chunk.rows, snapshot, chunk.watch.length, over)
                chunk, period = chunk.without(over), period.without(over)
            if not chunk.rows.size:
                break
            chunk.images.note(period)
            chunk.q, chunk.rates = self.drives.advance(period, self.dt)
            step += 1
            done(step / (self.steps + 1))
        done(1.0)

    def _chunk(self, rows: NDArray[np.int64]) -> Chunk:
        """Return some runs at their start; `endings.begin` fills the watch."""
        runs = rows.size
        still, before = np.empty(runs, dtype=np.int64), np.empty((3, runs))
        watch = Watch(np.empty(runs), np.empty(runs), still, before, np.empty(runs))
        number = (rows + self.first_run).astype(np.uint64)
        noise = Noise(self.sensing.noise, np.uint64(self.seed), number)
        images = ImageStream(self.sensing, self.controller.sights, self.drives, self.dt)
        q, rates = runs_last(self.q0[rows], 1), np.zeros((self.scene.nv, runs))
        return Chunk(rows, q, rates, noise, images, watch, np.zeros(runs, dtype=np.int64), {})


def _stride(loop: Loop, chunk: Chunk, step: int) -> tuple[int, Snapshot]:
    """Advance by many steps in compiled code, until a run ends or a burst is over."""
    controller, recorder, runs = loop.controller, loop.recorder, chunk.rows.size
    k, n, nv = controller.k, controller.columns.size, loop.scene.nv
    sight = controller.sights[0]
    command = Command(
        np.empty((k, runs)), np.empty((k, runs)), np.empty((n, runs)), np.empty((k, n, runs))
    )
    projection, qd, outcome = sight.room(runs), np.empty((nv, runs)), np.empty(runs, np.int8)
    step = kernels.stride(
        step,
        min(step + max(BURST // runs, 1), loop.steps),
        loop.steps,
        loop.dt,
        loop.scene.tree.joints,
        loop.limits,
        np.full(runs, loop.hold),
        loop.still,
        sight.constants,
        loop.moves,
        loop.scheme,
        chunk.noise,
        chunk.watch,
        chunk.rows,
        recorder.every or 0,
        recorder.series,
        chunk.q,
        chunk.rates[:0],
        projection,
        command,
        qd,
        outcome,
    )
    seen = {sight.key: projection}
    now = Snapshot(chunk.q, qd, chunk.rates[:0], seen, projection.pixels, command, outcome)
    return step, now


def _step(loop: Loop, chunk: Chunk, step: int) -> tuple[int, Snapshot]:
    """Advance by one step in Python, in the same sequence as `kernels.stride`.

    Any feature, law or belief may be a user's.
    """
    controller, runs = loop.controller, chunk.rows.size
    sights = controller.sights
    seen = {sight.key: sight.project(chunk.q) for sight in sights}
    every = joined(list(seen.values()), runs)
    measurement = _measurement(loop, chunk, step, every, seen)
    decision = controller.decided(measurement)
    command, hold = decision.command, loop.hold | controller.busy(measurement)
    bodies = seen[sights[0].key].bodies if sights else loop.scene.tree.bodies(chunk.q)
    T = loop.scene.tree.frame(bodies, controller.moving)
    qd, outcome = np.empty((loop.scene.nv, runs)), np.empty(runs, dtype=np.int8)
    drift = loop.still if loop.steady else loop.scene.drift(step * loop.dt)
    rates = _rates(loop, chunk, drift)
    kernels.settle(
        step,
        loop.steps,
        loop.limits,
        hold,
        drift,
        controller.columns,
        controller.pace,
        controller.tolerance,
        chunk.watch,
        chunk.rows,
        loop.recorder.every or 0,
        loop.recorder.series,
        chunk.q,
        rates,
        every,
        T,
        command,
        qd,
        outcome,
    )
    if not loop.prompt or loop.drives.moves:
        _wait(loop, chunk, step, command, rates, outcome)
    snapshot = Snapshot(chunk.q, qd, rates, seen, every.pixels, command, outcome)
    if loop.on_step:
        loop.on_step(snapshot, decision)
    return step, snapshot


def _rates(loop: Loop, chunk: Chunk, drift: Array) -> Array:
    """Return the velocities (nv, B) at which the joints move; none where each is as commanded."""
    if not loop.drives.moves:
        return chunk.rates[:0]
    prescribed = loop.scene.prescribed[:, None]
    return loop.scene.tree.driven(chunk.q, np.where(prescribed, drift[:, None], chunk.rates))


def _wait(
    loop: Loop,
    chunk: Chunk,
    step: int,
    command: Command,
    rates: Array,
    outcome: NDArray[np.int8],
) -> None:
    """Let runs go on that only pass their goal, and have moved since the image was taken.

    The error must have been below the tolerance in every period since then; and what the joints
    do otherwise than commanded must not move a feature by the tolerance in the time 1/pace.
    """
    controller = loop.controller
    near = (np.abs(command.error) < controller.tolerance).all(axis=0)
    if loop.drives.moves:
        lag = np.ascontiguousarray((rates[controller.columns] - command.qd)[:, None])
        change = product(command.task_jacobian, lag)[:, 0]
        near &= (np.abs(change) < controller.tolerance * controller.pace).all(axis=0)
    chunk.near = np.where(near, chunk.near + 1, 0)
    passing = (outcome == Outcome.CONVERGED) & (chunk.near <= chunk.images.age(step))
    outcome[passing] = Outcome.TIME_LIMIT if step == loop.steps else Outcome.RUNNING


def _measurement(
    loop: Loop, chunk: Chunk, step: int, every: Projection, seen: dict[Key, Projection]
) -> Measurement:
    """Return what the sensors give the controller at a step, with the faults of `sensing`."""
    if loop.prompt:
        pixels = np.empty_like(every.pixels)
        kernels.measure(every.pixels, chunk.noise, step, pixels)
        measured = {key: pixels[rows] for key, rows in zip(seen, loop.rows, strict=True)}
        return Measurement(step, loop.dt, chunk.q, seen, measured, chunk.memory)
    image = chunk.images.at(step, every, chunk.noise)
    parts = {key: image.of(rows) for key, rows in zip(seen, loop.rows, strict=True)}
    return Measurement(
        step,
        loop.dt,
        loop.drives.counted(chunk.q),
        {key: seen[key]._replace(depth=part.depth) for key, part in parts.items()},
        {key: part.pixels for key, part in parts.items()},
        chunk.memory,
        {key: part.hidden for key, part in parts.items()} if image.hidden.any() else {},
        prompt=False,
    )


def _mark_singular(controller: Controller, snapshot: Snapshot) -> None:
    """Mark a stall where L J has lost rank as a singularity, not a local minimum."""
    stalled = np.flatnonzero(snapshot.outcome == Outcome.LOCAL_MINIMUM)
    if stalled.size:
        task_jacobian = some_runs(snapshot.command.task_jacobian, stalled)
        lost = rank(task_jacobian, controller.rcond) < controller.full_rank
        snapshot.outcome[stalled[lost]] = Outcome.SINGULAR
