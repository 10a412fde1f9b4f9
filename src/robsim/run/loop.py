"""The one loop: every run of every servo scheme goes through here, a chunk of runs in lockstep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, runs_last, some_runs
from robsim.base.errors import InputError
from robsim.kernels import loop as kernels
from robsim.kernels.endings import Watch
from robsim.kernels.jit import is_cold
from robsim.kernels.loop import Command, Noise, Scheme
from robsim.kernels.sight import Look
from robsim.robot.joint import LIMIT_SLACK
from robsim.run.drives import Drives, Held
from robsim.run.frames import Frames, check_sensing
from robsim.run.outcome import Outcome
from robsim.run.record import Record, Recorder
from robsim.servo.controller import Controller, Decision
from robsim.servo.instant import Instant
from robsim.servo.laws.inverse import product, rank
from robsim.servo.sight import Key, joined
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

WORTH_COMPILING = 1000  # steps of runs; compiling the whole loop for fewer costs more than it saves
BURST = 100_000  # steps of runs that go on in compiled code before Ctrl-C is looked for


def pays(runs: int, steps: float) -> bool:
    """Whether to take the compiled loop, which gives the same bits: it is there, or worth it."""
    there = getattr(kernels.stride, "signatures", ()) or not is_cold("loop.stride")
    return bool(there) or runs * steps >= WORTH_COMPILING


@dataclass
class Loop:
    """What all chunks share: constants, the record, and whether to stop."""

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
    witness: Witness | None = None
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
        """Of the pixels, by sight."""
        counts = [len(sight.target.marks) for sight in self.controller.sights]
        return [slice(*pair) for pair in pairwise(np.cumsum([0, *counts]).tolist())]

    def _scheme(self) -> Scheme | None:
        """For the compiled loop, where that can run all that is asked for, and pays."""
        usual = self.steady and self.prompt and self.scene.tree.compiled
        plain = usual and not (self.drives.moves or self.witness)
        scheme = self.controller.compiled if plain else None
        return scheme if scheme and pays(len(self.q0), self.steps) else None

    @property
    def scene(self) -> Scene:
        """The true one."""
        return self.controller.scene

    def advance(self, rows: NDArray[np.int64], done: Callable[[float], None]) -> None:
        """Take a chunk of runs from their starts to their ends, in lockstep."""
        step, chunk = 0, _Chunk.start(self, rows)
        go_on = _stride if self.scheme else _step
        while not self.stopped or step:  # a chunk that has begun is left at a recorded instant
            step, now = go_on(self, chunk, step)
            over, held = (now.outcome > 0) | self.stopped, Held(chunk.q, chunk.rates, now.qd)
            if over.any():
                _tell_singular(self.controller, now)
                self.recorder.end(step, chunk.rows, now, chunk.watch.length, over)
                chunk, held = chunk.without(over), Held(*(some_runs(part, ~over) for part in held))
            if not chunk.rows.size:
                break
            chunk.frames.note(held)
            chunk.q, chunk.rates = self.drives.advance(held, self.dt)
            step += 1
            done(step / (self.steps + 1))
        done(1.0)


class Moment(NamedTuple):
    """What a witness of the loop is told of an instant."""

    now: Instant  # what the controller was told
    looks: dict[Key, Look]  # what there is
    decision: Decision  # of the controller, with what it is based on
    q: Array  # (nq, B) as it is
    qd: Array  # (nv, B) commanded


Witness = Callable[[Moment], None]


class Now(NamedTuple):
    """The instant at which a chunk stands: coordinates, all velocities, and what was seen."""

    q: Array  # (nq, B)
    qd: Array  # (nv, B)
    rates: Array  # (nv, B) of the joints where they do not follow at once; else no rows
    pixels: Array  # (N, 2, B) of all sights, without noise
    command: Command
    outcome: NDArray[np.int8]


@dataclass
class _Chunk:
    """The runs of a chunk that go on."""

    rows: NDArray[np.int64]
    q: Array
    rates: Array  # (nv, B) velocities of the joints
    noise: Noise
    frames: Frames
    watch: Watch
    near: NDArray[np.int64]  # (B,) instants in a row at which the run seemed to have converged
    memory: dict[str, Any]  # of the controller, run first

    @classmethod
    def start(cls, loop: Loop, rows: NDArray[np.int64]) -> _Chunk:
        """The chunk at its start; `endings.begin` fills the watch."""
        runs = rows.size
        still, before = np.empty(runs, dtype=np.int64), np.empty((3, runs))
        watch = Watch(np.empty(runs), np.empty(runs), still, before, np.empty(runs))
        number = (rows + loop.first_run).astype(np.uint64)
        noise = Noise(loop.sensing.noise, np.uint64(loop.seed), number)
        frames = Frames(loop.sensing, loop.controller.sights, loop.drives, loop.dt)
        q, rates = runs_last(loop.q0[rows], 1), np.zeros((loop.scene.nv, runs))
        return cls(rows, q, rates, noise, frames, watch, np.zeros(runs, dtype=np.int64), {})

    def without(self, over: NDArray[np.bool_]) -> _Chunk:
        """The chunk that goes on when some runs are over."""
        noise = self.noise._replace(runs=self.noise.runs[~over])
        watch = Watch(*(some_runs(array, ~over) for array in self.watch))
        memory = _remembered(self.memory, ~over)
        q, rates = some_runs(self.q, ~over), some_runs(self.rates, ~over)
        frames = self.frames.without(over)
        near = self.near[~over]
        return _Chunk(self.rows[~over], q, rates, noise, frames, watch, near, memory)


def _stride(loop: Loop, chunk: _Chunk, step: int) -> tuple[int, Now]:
    """With a built-in scheme: many steps in compiled code, until a run ends or a while is over."""
    controller, recorder, runs = loop.controller, loop.recorder, chunk.rows.size
    k, n, nv = controller.k, controller.columns.size, loop.scene.nv
    sight = controller.sights[0]
    command = Command(
        np.empty((k, runs)), np.empty((k, runs)), np.empty((n, runs)), np.empty((k, n, runs))
    )
    look, qd, outcome = sight.room(runs), np.empty((nv, runs)), np.empty(runs, np.int8)
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
        look,
        command,
        qd,
        outcome,
    )
    return step, Now(chunk.q, qd, chunk.rates[:0], look.pixels, command, outcome)


def _step(loop: Loop, chunk: _Chunk, step: int) -> tuple[int, Now]:
    """With anybody's feature, law or belief: one step, the same sequence as in `kernels.stride`."""
    controller, runs = loop.controller, chunk.rows.size
    sights = controller.sights
    looks = [sight.look(chunk.q) for sight in sights]
    look, told = joined(looks, runs), {s.key: each for s, each in zip(sights, looks, strict=True)}
    now = _told(loop, chunk, step, look, told)
    decision = controller.decided(now)
    command, hold = decision.command, loop.hold | controller.busy(now)
    bodies = looks[0].bodies if looks else loop.scene.tree.bodies(chunk.q)
    T = loop.scene.tree.frame(bodies, controller.moving)
    qd, outcome = np.empty((loop.scene.nv, runs)), np.empty(runs, dtype=np.int8)
    drift = loop.still if loop.steady else loop.scene.drift(step * loop.dt)
    rates = chunk.rates[:0]
    if loop.drives.moves:
        rates = np.where(loop.scene.prescribed[:, None], drift[:, None], chunk.rates)
        rates = loop.scene.tree.driven(chunk.q, rates)
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
        look,
        T,
        command,
        qd,
        outcome,
    )
    if not loop.prompt or loop.drives.moves:
        _wait(loop, chunk, step, command, rates, outcome)
    if loop.witness:
        loop.witness(Moment(now, told, decision, chunk.q, qd))
    return step, Now(chunk.q, qd, rates, look.pixels, command, outcome)


def _wait(
    loop: Loop,
    chunk: _Chunk,
    step: int,
    command: Command,
    rates: Array,
    outcome: NDArray[np.int8],
) -> None:
    """A run that only passes its goal goes on: it moved since its image was taken, or will yet.

    The error must have been below the tolerance in every period since then; and what the joints
    do otherwise than commanded must not move a feature by the tolerance in the time 1/pace.
    """
    controller = loop.controller
    near = (np.abs(command.error) < controller.tolerance).all(axis=0)
    if loop.drives.moves:
        lag = np.ascontiguousarray((rates[controller.columns] - command.qd)[:, None])
        change = product(command.reach, lag)[:, 0]
        near &= (np.abs(change) < controller.tolerance * controller.pace).all(axis=0)
    chunk.near = np.where(near, chunk.near + 1, 0)
    passing = (outcome == Outcome.CONVERGED) & (chunk.near <= chunk.frames.old(step))
    outcome[passing] = Outcome.TIME_LIMIT if step == loop.steps else Outcome.RUNNING


def _told(loop: Loop, chunk: _Chunk, step: int, look: Look, looks: dict[Key, Look]) -> Instant:
    """What the controller learns of an instant; late or spoilt, if that is asked for."""
    if loop.prompt:
        pixels = np.empty_like(look.pixels)
        kernels.measure(look.pixels, chunk.noise, step, pixels)
        measured = {key: pixels[rows] for key, rows in zip(looks, loop.rows, strict=True)}
        return Instant(step, loop.dt, chunk.q, looks, measured, chunk.memory)
    frame = chunk.frames.at(step, look, chunk.noise)
    parts = {key: frame.of(rows) for key, rows in zip(looks, loop.rows, strict=True)}
    return Instant(
        step,
        loop.dt,
        loop.drives.counted(chunk.q),
        {key: looks[key]._replace(depth=part.depth) for key, part in parts.items()},
        {key: part.pixels for key, part in parts.items()},
        chunk.memory,
        {key: part.hidden for key, part in parts.items()} if frame.hidden.any() else {},
        prompt=False,
    )


def _remembered(memory: dict[str, Any], going: NDArray[np.bool_]) -> dict[str, Any]:
    """What a controller or a user's law remembers of the runs that go on."""
    kept: dict[str, Any] = {}
    for name, value in memory.items():
        if isinstance(value, dict):
            kept[name] = _remembered(value, going)
        else:
            kept[name] = _rows(name, value, going.size)[going]
    return kept


def _rows(name: str, value: Any, runs: int) -> NDArray[Any]:
    """An array with a row for each run; InputError if what is remembered is none."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        array = np.empty(())
    if array.shape[:1] != (runs,):
        raise InputError(
            f"memory {name!r}: expected an array with a row for each of {runs} runs, "
            f"got {value!r:.80}"
        )
    return array


def _tell_singular(controller: Controller, now: Now) -> None:
    """A stall where L J has lost rank is a singularity, not a local minimum."""
    stalled = np.flatnonzero(now.outcome == Outcome.LOCAL_MINIMUM)
    if stalled.size:
        reach = some_runs(now.command.reach, stalled)
        lost = rank(reach, controller.rcond) < controller.full_rank
        now.outcome[stalled[lost]] = Outcome.SINGULAR
