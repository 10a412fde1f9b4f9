"""The stages of a step of a simulation, in their order, and their reuse by later runs."""

from __future__ import annotations

import operator
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.value import is_immutable
from robsim.engine.chunk import Chunk
from robsim.engine.chunk_state import ChunkState
from robsim.engine.image_stream import ImageStream
from robsim.engine.plant import Plant
from robsim.engine.recorder import Recorder, group_rows
from robsim.engine.termination_checks import TerminationChecks
from robsim.kernels.machine.program import CompiledStages, Program, PythonStage
from robsim.kernels.machine.stages import advance_blocks
from robsim.servo.command import Decision
from robsim.servo.task_controller import LAST_STEPS

if TYPE_CHECKING:
    from robsim.engine.loop import Loop


def find_steps(loop: Loop) -> Steps:
    """Return the stages of a loop without a record.

    A controller that is kept also keeps the stages of its last single run. They are used again if
    nothing that they depend on differs but a constant gain.
    """
    parts = loop.sensing, loop.actuation
    settings = loop.dt, loop.steps, loop.seed, loop.hold, loop.limited, loop.first_run
    key = *settings, loop.q0.tobytes()
    steps: Steps
    kept = vars(loop.controller)
    last: Any = kept.get(LAST_STEPS) or (None, (), None)
    last_key, last_parts, steps = last
    others = (loop.numbers, loop.guard, loop.driven)
    alone = len(loop.q0) == 1 and not loop.endings and all(each is None for each in others)
    if not alone or key != last_key or any(map(operator.is_not, parts, last_parts)):
        steps = Steps(loop)
        if LAST_STEPS in kept and alone and steps.is_stateless and all(map(is_immutable, parts)):
            steps.program.join_constants()
            kept[LAST_STEPS] = key, parts, steps
    elif steps.controller is not loop.controller:
        steps = steps.with_gain(loop.controller)
    return steps


class Steps:
    """The sequence of a step: motion, world, measurement, command, termination, record."""

    _fast: CompiledStages | None  # all stages, if they are compiled
    _rescue_rows: list[int]

    def __init__(self, loop: Loop) -> None:
        program = self.program = Program()
        controller = self.controller = loop.controller
        motion = loop.actuation, loop.scene, controller.columns, loop.q0
        settings = loop.dt, loop.seed, loop.runs, loop.driven
        plant = self.plant = Plant(program, *motion, *settings)
        imperfections = loop.sensing, loop.steps, controller.optional_pairs
        detection = controller.detectors, controller.believed_sights, controller.picture_sights
        images = self.images = ImageStream(
            program, plant, controller.sights, *imperfections, *detection
        )
        judge = self.judge = TerminationChecks(program, controller, loop.steps, loop.endings)
        self.row, self.alive = program.whole(np.arange(len(loop.q0))), program.constant(1.0)

        images.remember()
        plant.move()
        self.motion = len(program.calls)
        plant.place()
        images.add_image_stages()
        observed = images.measure()
        guard = loop.guard
        self.command = (
            guard.stages(controller, observed).outputs if guard else controller.stages(observed)
        )
        self.command.note(self.command.qd)
        plant.command(self.command.qd)
        judge.judge(plant, images, self.command, loop.hold, loop.limited)
        true, command = images.true[: 2 * images.N], self.command
        self.recorded_rows = group_rows(
            *(plant.q, plant.qd, plant.rates, command.s, true, command.weights),
            *(images.hashes, command.factors, command.active, command.slack),
            *plant.torques,
        )
        self.end_rows = [*self.recorded_rows, *group_rows(judge.length, judge.ending)]
        stages = program.stages
        self._fast = None if stages is None else CompiledStages(stages)

    @property
    def is_stateless(self) -> bool:
        """Whether the stages keep nothing from run to run: no Python stages, no tables."""
        tables = any(each.flags.writeable for each in self.program.referenced_arrays)
        return self.program.stages is not None and not tables

    def with_gain(self, controller: Any) -> Steps:
        """Return these stages for a controller that differs in a constant gain only."""
        own, program = copy(self), self.program.copy()
        assert self.command.gain is not None
        for row, number in (
            (self.command.gain, controller.gain),
            (self.judge.pace, controller.pace),
        ):
            program.same.append((row, np.array([number])))  # the last value of a row counts
        own.controller, own.program = controller, program
        return own

    def record_to(self, recorder: Recorder) -> Steps:
        """Return these stages, followed by the stages that record runs."""
        own, program = copy(self), self.program.copy()
        recorder.keep(program, self.row, self.alive, self.recorded_rows)
        recorder.end(program, self.row, self.alive, self.judge.outcome, self.end_rows)
        stages = program.stages
        if self._fast is not None and stages is not None:
            own._fast = self._fast.extend(stages[len(self._fast.addresses) :])
        own.program, own._rescue_rows = program, program.rescues
        return own

    @cached_property
    def _segments(self) -> tuple[list[PythonStage], list[PythonStage]]:
        """The stages of a step and of the first step, for sequences with Python stages."""
        return self.program.segments(), self.program.segments(self.motion)

    @property
    def compiled(self) -> bool:
        """Whether compiled stages alone can take several steps."""
        return self._fast is not None

    def run(self, chunk: Chunk, step: int, until: int) -> None:
        """Advance all runs of a chunk from one step until before another."""
        if self._fast is None or not self._advance(self._fast, chunk, step, until):
            for now in range(step, until):
                for part in self._segments[now == 0]:
                    part(chunk, now)

    def _advance(self, compiled: CompiledStages, chunk: Chunk, step: int, until: int) -> bool:
        """Take the steps by compiled stages; return False if a stage needs Python.

        Before returning False the state is restored. The record of these steps is then written
        again.
        """
        before = chunk.numbers.copy() if self._rescue_rows else chunk.numbers
        arguments = compiled.addresses, compiled.at, compiled.numbers, self.motion
        advance_blocks(*arguments, chunk.flat, int(self.alive), step, until)  # positional: faster
        if not any(chunk.numbers[:, row].any() for row in self._rescue_rows):
            return True
        chunk.numbers[:] = before
        return False

    def stop(self, recorder: Recorder, chunk: Chunk, step: int) -> None:
        """Record the present state of the runs of a chunk."""
        recorder.stop(chunk, step, self.end_rows)

    def snapshot(self, chunk: Chunk) -> ChunkState:
        """Return the state of a chunk at this step, with the projections of its cameras."""
        q = chunk.get(self.plant.q)
        return ChunkState(
            q,
            chunk.get(self.plant.qd),
            chunk.get(self.plant.rates),
            {sight.key: sight.project(q, chunk.rows) for sight in self.images.sights},
            chunk.get(self.images.true, self.images.N, 2),
            self.decision(chunk).command,
            chunk.get(self.judge.outcome).astype(np.int8),
        )

    def decision(self, chunk: Chunk) -> Decision:
        """Return the decision of the controller at this step."""
        return self.controller.scale_to_tolerances(self.command.decide(chunk))
