"""A controller outside of the loop: one command from one measurement, by the same stages."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.program import Blocks, Program
from robsim.servo.controller import Controller, Decision
from robsim.servo.given import alone
from robsim.servo.sight import Key


class Standalone:
    """The stages of a controller alone, which is given coordinates and pixels by hand."""

    def __init__(self, controller: Controller, dt: float, hides: bool = False) -> None:
        self.controller = controller
        program = self.program = Program()
        self.given = alone(program, controller.sights, controller.scene.nq, dt, hides)
        self.commanded = controller.stages(self.given)
        self.commanded.note(self.commanded.qd)
        self._parts = program.segments()

    def begin(self, runs: int) -> Blocks:
        """Return blocks of so many runs that begin."""
        return Blocks(self.program, np.zeros(runs, dtype=np.int64))

    def decide(
        self,
        blocks: Blocks,
        step: int,
        q: Array,
        pixels: Mapping[Key, Array],
        depth: Mapping[Key, Array],
    ) -> Decision:
        """Return what is decided of q (nq, B), pixels (N, 2, B) and depths (N, B) at a step."""
        blocks.put(self.given.q, q)
        for key, view in self.given.views.items():
            blocks.put(view.pixels, pixels[key])
            blocks.put(view.depth, depth[key])
        for part in self._parts:
            part(blocks, step)
        decision: Decision = self.commanded.decide(blocks)
        return decision
