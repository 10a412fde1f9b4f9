"""The simulation loop, which advances the runs of a chunk in lockstep."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare.problems import prefix_path
from robsim.engine.chunk import Chunk, ChunkProgress
from robsim.engine.command_checks import check_command_quantity
from robsim.engine.endings import Ending
from robsim.engine.image_stream import check_sensing
from robsim.engine.outcome import Outcome
from robsim.engine.plant import has_actuation_dynamics
from robsim.engine.recorder import Record, Recorder
from robsim.engine.steps import Steps, find_steps
from robsim.servo.safety.guard import SafetyGuard
from robsim.servo.task_controller import TaskController
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    from robsim.engine.driven_joints import DrivenJoints

BURST = 64  # largest number of compiled steps between two checks for a stop
LOOK = 0.05  # approximate seconds between these checks
MOST_PIXELS = 30_000_000  # of the pictures that are in memory at once in a thread
FIRST = 4096  # runs times steps of the first burst, to measure its duration


@dataclass
class Loop:
    """The constants of a simulation, its record, and flags to stop it, shared by all chunks.

    If `stopped` or `paused` is set, chunks return after a step and can be continued.
    """

    controller: TaskController
    q0: Array  # (runs, nq)
    dt: float
    steps: int
    seed: int = 0
    sensing: Sensing = field(default_factory=Sensing)
    actuation: Actuation = field(default_factory=Actuation)
    hold: bool = False
    first_run: int = 0
    numbers: NDArray[np.int64] | None = None  # numbers of the runs, which determine their noise
    record: Record = "summary"
    single: bool = False  # whether the start is a vector, not a batch with one row
    limited: bool = True  # whether joint limits end a run
    endings: tuple[Ending, ...] = ()
    guard: SafetyGuard | None = None
    stopped: bool = field(default=False, init=False)
    paused: bool = field(default=False, init=False)
    recorder: Recorder = field(init=False)
    driven: DrivenJoints | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        controller, scene = self.controller, self.scene
        room = self.steps, len(self.q0)
        with prefix_path("sensing"):
            check_sensing(self.sensing, controller.sights, self.dt, *room)
        self.actuation.check(scene.velocity_names, scene.coordinate_names)
        if self.actuation.drive is not None:
            from robsim.engine.driven_joints import DrivenJoints  # late: few runs have drives

            moved = self.actuation, controller.columns, self.dt
            self.driven = DrivenJoints.of(scene, *moved)
            self.driven.check()
        check_command_quantity(controller, self.driven, self.guard)
        if pictured := controller.picture_sights:
            from robsim.engine.mark_detection import check_detection  # late: they import renderers
            from robsim.engine.picture_taking import check_pictures

            with prefix_path("task", "detector"):
                check_detection(controller.sights, controller.detectors)
            check_pictures(pictured, self.dt)
        rates = scene.nv if has_actuation_dynamics(self.actuation, scene) else 0
        weights = controller.k if controller.has_weights else 0
        widths = (
            *(scene.nq, scene.nv, rates, controller.k, 2 * controller.marks, weights),
            len(controller.picture_cameras),
            controller.factor_count,
            *(len(controller.constraint_labels),) * 2,
            *(0 if self.driven is None else scene.nv,) * 2,
        )
        with prefix_path("run", "record"):
            self.recorder = Recorder(len(self.q0), self.steps, self.record, widths)

    @property
    def scene(self) -> Scene:
        """The true scene."""
        return self.controller.scene

    @property
    def most_runs_together(self) -> int:
        """The largest number of runs in a chunk whose pictures fit in memory at once."""
        pictured = self.controller.picture_sights.values()
        sizes = [sight.eye.camera.size or (0, 0) for sight in pictured]
        pixels = sum(width * height for width, height in sizes)
        return max(MOST_PIXELS // pixels, 1) if pixels else len(self.q0)

    @property
    def runs(self) -> NDArray[np.int64]:
        """The number of each run; by default they are consecutive."""
        if self.numbers is None:
            return self.first_run + np.arange(len(self.q0))
        return self.numbers

    @cached_property
    def sequence(self) -> Steps:
        """The stages of a step, for all chunks."""
        return find_steps(self).record_to(self.recorder)

    def advance(self, going: ChunkProgress, done: Callable[[float], None]) -> None:
        """Simulate a chunk of runs, in lockstep, to its end or until `stopped` or `paused`.

        `done` is called with the finished share.
        """
        burst = min(max(FIRST // len(going.rows), 1), BURST)
        while not (going.done or self.stopped or self.paused):
            began = time.perf_counter()
            self._take(going, burst)
            self._settle(going)
            done(1.0 if going.done else going.step / (self.steps + 1))
            seconds = max(time.perf_counter() - began, 1e-9)
            burst = min(max(int(burst * min(LOOK / seconds, 2.0)), 1), BURST)

    def instants(
        self, rows: NDArray[np.int64], past_convergence: bool = False
    ) -> Iterator[tuple[int, Chunk]]:
        """Simulate a chunk of runs, and yield each step with the chunk.

        With `past_convergence`, converged runs go on until the last step; their outcome is
        CONVERGED at each instant with a small error.
        """
        going = ChunkProgress(rows)
        while not going.done:
            chunk = self._take(going, 1)
            yield going.step - 1, chunk
            if past_convergence and going.step <= self.steps:
                self._revive_converged_runs(chunk)
            self._settle(going)

    def _revive_converged_runs(self, chunk: Chunk) -> None:
        """Let the converged runs of a chunk go on."""
        converged = chunk.get(self.sequence.judge.outcome) == Outcome.CONVERGED
        alive = chunk.get(self.sequence.alive)
        chunk.put(self.sequence.alive, np.where(converged, 1.0, alive))

    def leave(self, chunks: Sequence[ChunkProgress]) -> None:
        """Store the last instants of the runs that have begun."""
        for going in chunks:
            if going.chunk is not None:
                self.sequence.stop(self.recorder, going.chunk, going.step - 1)

    def _take(self, going: ChunkProgress, burst: int) -> Chunk:
        """Take several steps if all stages are compiled, else one."""
        chunk = going.chunk = going.chunk or Chunk(self.sequence.program, going.rows)
        steps = burst if self.sequence.compiled else 1
        until = min(going.step + steps, self.steps + 1)
        self.sequence.run(chunk, going.step, until)
        going.step = until
        return chunk

    def _settle(self, going: ChunkProgress) -> None:
        """Remove the runs that have ended from the chunk."""
        if going.chunk is None:
            return
        alive = going.chunk.get(self.sequence.alive) != 0.0
        left = np.count_nonzero(alive)
        if not left:
            going.done, going.chunk = True, None
        elif left < alive.size:
            going.chunk.keep(alive)
