"""The stage of a controller that is written in Python: a measurement for it, and its command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robsim.kernels.program import Blocks
from robsim.servo.controller import Decision
from robsim.servo.given import Commanded, Given
from robsim.servo.measurement import Measurement

if TYPE_CHECKING:
    from robsim.servo.tasks.follower import Follower


class Deciding:
    """The stage in which a controller is shown a measurement and decides."""

    def __init__(self, controller: Follower, given: Given) -> None:
        self.controller, self.given = controller, given
        c, rows = controller, given.program.rows
        k, n = c.k, c.columns.size
        made, self.J = (rows(k), rows(k), rows(n), rows(k * n), rows()), rows(6 * n)
        self.rows = Commanded(*made, self.last, lambda qd: None)

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Write what the controller decides of the runs at a step."""
        measurement, rows = self.measurement(blocks, step), self.rows
        decision = self.controller.decide(measurement)
        command, blocks.made[self] = decision.command, decision
        for row, values in (
            (rows.s, command.s),
            (rows.error, command.error),
            (rows.qd, command.qd),
            (rows.task_jacobian, command.task_jacobian),
            (self.J, decision.J),
            (rows.busy, self.controller.busy(measurement)[None].astype(float)),
        ):
            blocks.put(row, values)

    def last(self, blocks: Blocks) -> Decision:
        """Return the decision of this step."""
        decision: Decision = blocks.made[self]
        return decision

    def measurement(self, blocks: Blocks, step: int) -> Measurement:
        """Return what the sensors give at a step."""
        given = self.given
        q = blocks.get(given.q, self.controller.scene.nq)
        return Measurement(step, given.seconds, q, given.memory(blocks))
