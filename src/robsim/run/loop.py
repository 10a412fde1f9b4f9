"""The simulation loop, in which the runs of a chunk advance in lockstep, whatever the task."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare.problems import under
from robsim.kernels.program import Compiled, Own, Program
from robsim.kernels.stage import advance
from robsim.run.chunk import Chunk
from robsim.run.drives import Drives
from robsim.run.endings import Ending
from robsim.run.images import check_sensing
from robsim.run.judge import Judge
from robsim.run.plant import Plant
from robsim.run.record import Record, Recorder
from robsim.run.sensor import Sensor
from robsim.run.snapshot import Snapshot
from robsim.servo.controller import Controller, Decision
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

BURST = 64  # steps that compiled stages take before Ctrl-C is looked for


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
    limited: bool = True  # whether joint limits end a run
    endings: tuple[Ending, ...] = ()
    stopped: bool = field(default=False, init=False)
    recorder: Recorder = field(init=False)

    def __post_init__(self) -> None:
        controller, scene = self.controller, self.scene
        room = self.steps, len(self.q0)
        with under("sensing"):
            check_sensing(self.sensing, controller.sights, self.dt, *room)
        self.actuation.check(scene.velocity_names, scene.coordinate_names)
        self.drives = Drives(self.actuation, scene, controller.columns)
        rates = scene.nv if self.drives.moves else 0
        widths = (scene.nq, scene.nv, rates, controller.k, 2 * controller.marks)
        with under("run", "record"):
            self.recorder = Recorder(len(self.q0), self.steps, self.record, widths)

    @property
    def scene(self) -> Scene:
        """The true scene."""
        return self.controller.scene

    @cached_property
    def sequence(self) -> Sequence:
        """The stages of a step, for all chunks."""
        return Sequence(self)

    def advance(self, rows: NDArray[np.int64], done: Callable[[float], None]) -> None:
        """Simulate a chunk of runs from start to end, in lockstep."""
        if self.stopped:
            return
        for step, _ in self.instants(rows, BURST):
            done((step + 1) / (self.steps + 1))
        done(1.0)

    def instants(self, rows: NDArray[np.int64], burst: int = 1) -> Iterator[tuple[int, Chunk]]:
        """Simulate a chunk of runs, and yield each step, or the last of some, with the chunk."""
        sequence, step = self.sequence, 0
        chunk = Chunk(sequence.program, rows)
        while chunk.runs:
            until = min(step + burst, self.steps + 1) if sequence.compiled else step + 1
            sequence.run(chunk, step, until)
            step = until
            yield step - 1, chunk
            if self.stopped:  # a chunk that has begun is left at a recorded instant
                sequence.stop(self.recorder, chunk, step - 1)
                return
            alive = chunk.get(sequence.alive, 1)[0] != 0.0
            if not alive.all():
                chunk.keep(alive)


class Sequence:
    """The sequence of a step: motion, world, measurement, command, judgement, record."""

    def __init__(self, loop: Loop) -> None:
        program = self.program = Program()
        controller = self.controller = loop.controller
        runs = loop.first_run + np.arange(len(loop.q0))
        plant = self.plant = Plant(program, loop.drives, loop.q0, loop.dt, loop.seed, runs)
        spoilt = loop.sensing, loop.steps, loop.seed, runs
        sensor = self.sensor = Sensor(program, plant, controller.sights, *spoilt)
        judge = self.judge = Judge(program, controller, loop.steps, loop.endings)
        row, self.alive = program.whole(np.arange(len(loop.q0))), program.constant(1.0)

        sensor.remember()
        plant.move()
        self.motion = len(program.calls)
        plant.place()
        sensor.look()
        self.command = controller.stages(sensor.measure())
        self.command.note(self.command.qd)
        plant.command(self.command.qd)
        judge.judge(plant, sensor, self.command, loop.hold, loop.limited)
        self.kept = [plant.q, plant.qd, plant.rates, self.command.s, sensor.images.true]
        loop.recorder.keep(program, row, self.alive, self.kept)
        loop.recorder.end(program, row, self.alive, self.kept, judge.judged)
        stages = program.stages
        self._fast = None if stages is None else Compiled(stages)
        self._rescues = program.rescues

    @cached_property
    def _parts(self) -> tuple[list[Own], list[Own]]:
        """All stages of a step, and those of the first one, where some are in Python."""
        return self.program.segments(), self.program.segments(self.motion)

    @property
    def compiled(self) -> bool:
        """Whether several steps may be taken by compiled stages alone."""
        return self._fast is not None

    def run(self, chunk: Chunk, step: int, until: int) -> None:
        """Take all runs of a chunk from a step until before another."""
        if self._fast is None or not self._advance(self._fast, chunk, step, until):
            for now in range(step, until):
                for part in self._parts[now == 0]:
                    part(chunk, now)

    def _advance(self, made: Compiled, chunk: Chunk, step: int, until: int) -> bool:
        """Take the steps by compiled stages alone; return False if Python is needed, from before.

        What was kept of these steps is kept again.
        """
        before = chunk.numbers.copy() if self._rescues else chunk.numbers
        given = made.addresses, made.at, made.numbers, self.motion
        advance(*given, chunk.flat, self.alive, step, until)
        if not any(chunk.numbers[:, row].any() for row in self._rescues):
            return True
        chunk.numbers[:] = before
        return False

    def stop(self, recorder: Recorder, chunk: Chunk, step: int) -> None:
        """Keep the runs of a chunk that go on, as they are."""
        alive = chunk.get(self.alive, 1)[0] != 0.0
        if not alive.all():
            chunk.keep(alive)
        if chunk.runs:
            recorder.stop(chunk, step, self.kept, self.judge.judged)

    def snapshot(self, chunk: Chunk) -> Snapshot:
        """Return the state of a chunk at this step, with what its cameras see."""
        q, scene = chunk.get(self.plant.q, self.plant.scene.nq), self.plant.scene
        rates = scene.nv if self.plant.drives.moves else 0
        return Snapshot(
            q,
            chunk.get(self.plant.qd, scene.nv),
            chunk.get(self.plant.rates, rates),
            {sight.key: sight.project(q, chunk.rows) for sight in self.sensor.sights},
            chunk.get(self.sensor.images.true, self.sensor.images.N, 2),
            self.decision(chunk).command,
            chunk.get(self.judge.outcome, 1)[0].astype(np.int8),
        )

    def decision(self, chunk: Chunk) -> Decision:
        """Return what the controller has decided at this step, and on what basis."""
        return self.controller.scaled(self.command.decide(chunk))
