"""A controller outside the simulation loop: one command from one measurement."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.control.command_limits import remaining_share
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.camera_target import PairKey
from robsim.servo.command import Decision
from robsim.servo.controller_rows import allocate_inputs
from robsim.servo.safety.guard import SafetyGuard
from robsim.servo.task_controller import TaskController


class SingleStepController:
    """Stages of a controller alone, with coordinates and images from the caller.

    With a guard, marks may be hidden and images may be old.
    """

    def __init__(
        self, controller: TaskController, dt: float, guard: SafetyGuard | None = None
    ) -> None:
        self.controller, self.dt = controller, dt
        program, hides = Program(), guard is not None
        self.program = program
        self.inputs = allocate_inputs(program, controller.sights, controller.scene.nq, dt, hides)
        if guard is None:
            self.outputs = controller.stages(self.inputs)
        else:
            self.inputs = replace(self.inputs, age=program.rows(), released=program.rows())
            self.safety_stages = guard.stages(controller, self.inputs)
            self.outputs = self.safety_stages.outputs
        self.outputs.note(self.outputs.qd)
        self._segments = program.segments()
        if guard is not None:  # all input rows are contiguous, from q to released
            first, released = self.inputs.q, self.inputs.released
            assert released is not None
            self._input_rows = BlockRows(first, (released - first + 1,))
            self._input_template = self.begin(1).first(self._input_rows)

    def begin(self, runs: int) -> Blocks:
        """Return blocks of `runs` new runs."""
        return Blocks(self.program, np.zeros(runs, dtype=np.int64))

    def decide(
        self,
        blocks: Blocks,
        step: int,
        q: Array,
        pixels: Mapping[PairKey, Array],
        depth: Mapping[PairKey, Array],
    ) -> Decision:
        """Return the decision for q (nq, B), pixels (N, 2, B) and depths (N, B) at a step."""
        blocks.put(self.inputs.q, q)
        for key, view in self.inputs.views.items():
            blocks.put(view.pixels, pixels[key])
            blocks.put(view.depth, depth[key])
        self.perform(blocks, step)
        return self.outputs.decide(blocks)

    def take(
        self,
        blocks: Blocks,
        q: Array,
        images: Iterable[tuple[PairKey, Any]],
        age: float,
        released: float,
    ) -> None:
        """Write coordinates (nq,), images of a given age, and the permission of one run to move.

        An image has pixels (N, 2), depths (N,), and flags of hidden marks (N,).
        """
        first, rows = self.inputs.q, self._input_template.copy()
        rows[: len(q)] = q
        for key, image in images:
            for name in ("pixels", "depth", "hidden"):
                part = getattr(self.inputs.views[key], name)
                rows[part - first : part - first + part.size] = getattr(image, name).reshape(-1)
        rows[-2:] = age / self.dt, released
        blocks.fill(self._input_rows, rows)

    def perform(self, blocks: Blocks, step: int) -> None:
        """Perform the stages of one step."""
        for part in self._segments:
            part(blocks, step)

    def read(self, blocks: Blocks) -> tuple[int, Array, Array, Array, bool]:
        """Return the output of the stages for the first run, within the limits of its safety.

        The output is the bits of the active limits, the joints at limits, the error, the command,
        and whether the controller is busy.
        """
        first, c = blocks.first, self.outputs
        reasons, at_limit = self.read_reasons(blocks), first(self.safety_stages.at_limit)
        return reasons, at_limit, first(c.error), first(c.qd), bool(first(c.busy))

    def read_reasons(self, blocks: Blocks) -> int:
        """Return the bits of the active limits of the first run."""
        return int(blocks.first(self.safety_stages.reasons))

    def name_active_constraints(self, blocks: Blocks) -> tuple[str, ...]:
        """Return the names of the constraints that hold the command of the first run back."""
        if self.outputs.active is None:
            return ()
        acts = blocks.first(self.outputs.active) > 0.0
        return tuple(self.controller.constraint_labels[i] for i in np.flatnonzero(acts))

    def rest(self, blocks: Blocks) -> None:
        """Set the robot at rest; a command may grow again from there."""
        blocks.fill(self.safety_stages.last, np.zeros(self.controller.columns.size))
        blocks.fill(self.safety_stages.growth_time, np.zeros(1))

    def compute_braking(self, blocks: Blocks) -> Array:
        """Return the velocities (n,) of braking for one period, without the stages."""
        guarded = self.safety_stages
        last = blocks.first(guarded.last)
        rest = float((np.abs(last) / blocks.first(guarded.accelerations)).max(initial=0.0))
        slower: Array = last * remaining_share(rest, self.dt)
        self.rest(blocks)
        blocks.fill(guarded.last, slower)
        return slower

    def decision(self, blocks: Blocks) -> Decision:
        """Return the decision of the last step."""
        return self.outputs.decide(blocks)
