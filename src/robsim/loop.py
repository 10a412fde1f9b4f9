"""The one loop: every run of every servo scheme goes through here, a chunk of runs in lockstep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array, runs_last
from robsim.errors import InputError
from robsim.kernels import loop as kernels
from robsim.kernels import tree
from robsim.kernels.endings import Watch
from robsim.kernels.jit import is_cold
from robsim.kernels.loop import Command, Noise
from robsim.outcome import Outcome
from robsim.record import Record, Recorder
from robsim.robot import LIMIT_SLACK
from robsim.scene import Scene
from robsim.servo.controller import Controller
from robsim.servo.instant import Instant
from robsim.servo.inverse import rank
from robsim.servo.sight import joined

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
    seed: int
    noise: float
    hold: bool
    first_run: int
    record: Record
    stopped: bool = field(default=False, init=False)
    recorder: Recorder = field(init=False)

    def __post_init__(self) -> None:
        controller, scene = self.controller, self.scene
        widths = (scene.nq, scene.nv, controller.k, controller.goal_pixels.size)
        self.recorder = Recorder(len(self.q0), self.steps, self.record, widths)
        slack = np.array([-LIMIT_SLACK, LIMIT_SLACK])
        self.limits = np.ascontiguousarray(scene.limits + slack)
        self.steady = not any(callable(motion.rates) for motion in scene.motions)
        self.still = scene.drift(0.0)
        ends = np.cumsum([0, *(len(sight.target.marks) for sight in controller.sights)])
        self.moves = controller.sights[0].moves(controller.columns)
        self.rows = [slice(*pair) for pair in pairwise(ends.tolist())]  # of pixels, by sight
        scheme = controller.compiled if self.steady else None
        self.scheme = scheme if scheme and pays(len(self.q0), self.steps) else None

    @property
    def scene(self) -> Scene:
        """The true one."""
        scene: Scene = self.controller.scene
        return scene

    def advance(self, rows: NDArray[np.int64], done: Callable[[float], None]) -> None:
        """Take a chunk of runs from their starts to their ends, in lockstep."""
        step, chunk = 0, _Chunk.start(self, rows)
        go_on = _stride if self.scheme else _step
        joints = self.scene.tree.joints
        while not self.stopped or step:  # a chunk that has begun is left at a recorded instant
            step, now = go_on(self, chunk, step)
            over, qd = (now.outcome > 0) | self.stopped, now.qd
            if over.any():
                _tell_singular(self.controller, now)
                self.recorder.end(step, chunk.rows, now, chunk.watch.length, over)
                chunk, qd = chunk.without(over), _keep(now.qd, ~over)
            if not chunk.rows.size:
                break
            tree.integrate(joints.kind, joints.iq, joints.iv, qd, self.dt, chunk.q)
            step += 1
            done(step / (self.steps + 1))
        done(1.0)


class Now(NamedTuple):
    """The instant at which a chunk stands: coordinates, all velocities, and what was seen."""

    q: Array  # (nq, B)
    qd: Array  # (nv, B)
    pixels: Array  # (N, 2, B) of all sights, without noise
    command: Command
    outcome: NDArray[np.int8]


@dataclass
class _Chunk:
    """The runs of a chunk that go on."""

    rows: NDArray[np.int64]
    q: Array
    noise: Noise
    watch: Watch
    memory: dict[str, Any]  # of the controller, run first

    @classmethod
    def start(cls, loop: Loop, rows: NDArray[np.int64]) -> _Chunk:
        """The chunk at its start; `endings.begin` fills the watch."""
        runs = rows.size
        still, before = np.empty(runs, dtype=np.int64), np.empty((3, runs))
        watch = Watch(np.empty(runs), np.empty(runs), still, before, np.empty(runs))
        number = (rows + loop.first_run).astype(np.uint64)
        noise = Noise(loop.noise, np.uint64(loop.seed), number)
        return cls(rows, runs_last(loop.q0[rows], 1), noise, watch, {})

    def without(self, over: NDArray[np.bool_]) -> _Chunk:
        """The chunk that goes on when some runs are over."""
        noise = self.noise._replace(runs=self.noise.runs[~over])
        watch = Watch(*(_keep(array, ~over) for array in self.watch))
        memory = _remembered(self.memory, ~over)
        return _Chunk(self.rows[~over], _keep(self.q, ~over), noise, watch, memory)


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
        loop.hold,
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
        look,
        command,
        qd,
        outcome,
    )
    return step, Now(chunk.q, qd, look.pixels, command, outcome)


def _step(loop: Loop, chunk: _Chunk, step: int) -> tuple[int, Now]:
    """With anybody's feature, law or belief: one step, the same sequence as in `kernels.stride`."""
    controller, runs = loop.controller, chunk.rows.size
    sights = controller.sights
    looks = [sight.look(chunk.q) for sight in sights]
    look = joined(looks)
    pixels = np.empty_like(look.pixels)
    kernels.measure(look.pixels, chunk.noise, step, pixels)
    seen = {sight.key: each for sight, each in zip(sights, looks, strict=True)}
    measured = {sight.key: pixels[rows] for sight, rows in zip(sights, loop.rows, strict=True)}
    now = Instant(step, loop.dt, chunk.q, seen, measured, chunk.memory)
    command = controller.control(now)
    T = looks[0].T_w_c if sights[0].constants.moves else looks[0].T_w_o
    qd, outcome = np.empty((loop.scene.nv, runs)), np.empty(runs, dtype=np.int8)
    kernels.settle(
        step,
        loop.steps,
        loop.limits,
        loop.hold,
        loop.still if loop.steady else loop.scene.drift(step * loop.dt),
        controller.columns,
        controller.pace,
        controller.tolerance,
        chunk.watch,
        chunk.rows,
        loop.recorder.every or 0,
        loop.recorder.series,
        chunk.q,
        look,
        T,
        command,
        qd,
        outcome,
    )
    return step, Now(chunk.q, qd, look.pixels, command, outcome)


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


def _keep(array: Any, going: NDArray[Any]) -> Any:
    return np.ascontiguousarray(array[..., going])


def _tell_singular(controller: Controller, now: Now) -> None:
    """A stall where L J has lost rank is a singularity, not a local minimum."""
    stalled = np.flatnonzero(now.outcome == Outcome.LOCAL_MINIMUM)
    if stalled.size:
        reach = _keep(now.command.reach, stalled)
        lost = rank(reach, controller.rcond) < controller.full_rank
        now.outcome[stalled[lost]] = Outcome.SINGULAR
