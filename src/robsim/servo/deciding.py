"""The stage of a controller that is written in Python: a measurement for it, and its command."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robsim.servo.given import Commanded, Given
from robsim.servo.measurement import Measurement

if TYPE_CHECKING:
    from robsim.servo.controller import Controller


class Deciding:
    """The stage in which a controller is shown a measurement and decides."""

    def __init__(self, controller: Controller, given: Given) -> None:
        self.controller, self.given = controller, given
        c, rows = controller, given.program.rows
        k, n = c.k, c.columns.size
        self.rows = Commanded(rows(k), rows(k), rows(n), rows(k * n), rows(), self.last)

    def __call__(self, blocks: Any, step: int) -> None:
        """Write what the controller decides of the runs at a step."""
        measurement, rows = self.measurement(blocks, step), self.rows
        decision = self.controller.decide(measurement)
        command = decision.command
        self.controller.note(measurement, decision.basis, command.qd)
        blocks.decision = self.controller.scaled(decision)
        for row, values in (
            (rows.s, command.s),
            (rows.error, command.error),
            (rows.qd, command.qd),
            (rows.task_jacobian, command.task_jacobian),
            (rows.busy, self.controller.busy(measurement)[None]),
        ):
            blocks.put(row, values)

    @staticmethod
    def last(blocks: Any) -> Any:
        """Return the decision of this step."""
        return blocks.decision

    def measurement(self, blocks: Any, step: int) -> Measurement:
        """Return what the sensors give at a step."""
        given, nq = self.given, self.controller.scene.nq
        q = blocks.get(given.true, nq)
        seen, pixels = {}, {}
        for sight in self.controller.sights:
            view, N = given.views[sight.key], len(sight.target.marks)
            pixels[sight.key] = blocks.get(view.pixels, N, 2)
            seen[sight.key] = sight.project(q)._replace(depth=blocks.get(view.depth, N))
        prompt = given.placed is not None
        measured = q if prompt else blocks.get(given.q, nq)
        memory, hidden = blocks.memory, blocks.hidden
        return Measurement(
            step, given.seconds, measured, seen, pixels, memory, hidden, prompt=prompt
        )
