"""The stages of a step of the search for the coordinates of an arm."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.kernels.control.commanding import transpose, weigh
from robsim.kernels.inverse_kinematics import ik_step
from robsim.kernels.inverse_kinematics import ik_turns as turns
from robsim.kernels.linear_algebra import normal
from robsim.kernels.machine.program import Program
from robsim.kernels.machine.rows import Rows
from robsim.robot.assembly import integers
from robsim.robot.ik.arm import Arm
from robsim.robot.motion import add_motion, call_motion
from robsim.robot.placed import Placed


class Descent:
    """A search for the coordinates of an arm, by what of a pose counts.

    `weight` (6,) is of the rows (v, omega) in the axes of the base; if `pointing`, the rotation
    counts only where the z axis points. The program takes a step, and proposes the next.
    """

    def __init__(self, arm: Arm, weight: Array, pointing: bool) -> None:
        self.arm, self.weight, self.pointing = arm, weight, pointing
        self.tree, self.n = arm.tree, len(arm.columns)
        self.program = Program()
        self.state = self.program.rows(turns.Q)
        self.q = self.program.rows(self.tree.nq)
        self.step = self.program.rows(self.n)
        self.placed = Placed(self.program, self.tree.joints, self.q)
        self._limits = {
            int(i): self.program.constant([arm.bounds.low[i], arm.bounds.high[i]])
            for i in arm.bounds.row
            if i >= 0 and np.isfinite(arm.bounds.low[i])
        }
        self._move()
        self._propose(self._measure())

    @cached_property
    def prepared(self) -> tuple[Any, ...]:
        """What the compiled search needs of the stages."""
        return self.program.prepared()

    @cached_property
    def share(self) -> Array:
        """What the entries (12,) of the difference of two poses count for in the square of it."""
        found = np.full((3, 4), (self.weight[3:] ** 2).sum() / 6.0)
        found[:, : 2 if self.pointing else 0] = 0.0
        found[:, 3] = self.weight[:3] ** 2
        return frozen(found.ravel())

    @cached_property
    def rows(self) -> Any:
        """The coordinates that begin elsewhere at each search."""
        return integers(self.arm.bounds.row[self.arm.bounds.row >= 0])

    def _move(self) -> None:
        """Move coordinates by the step, into their limits, and place the bodies."""
        program, moved = self.program, dict(zip(self.arm.columns.tolist(), self.step, strict=True))
        rates = [moved.get(column) for column in range(self.tree.nv)]
        for add in (add_motion, call_motion):
            add(program, self.tree.joints, self.q, rates, program.constant(1.0))
        limited = self._limits.items()
        joints = [(self.q[i], limits, self.arm.bounds.turns[i]) for i, limits in limited]
        program.add(ik_step.confine, joints=joints)
        self.placed.add()

    def _measure(self) -> tuple[Rows, Rows, Rows]:
        """Add the stages of the error and the Jacobian; return their rows, and of the damping."""
        program, state = self.program, self.state
        goal = state[turns.GOAL : turns.GOAL + 12].reshape(3, 4)
        (T,) = self.placed.frames([self.tree.find(self.arm.link)])
        e, damping, weights = program.rows(6), program.rows(), program.constant(self.weight)
        if self.pointing:
            program.add(ik_step.point_to, goal=goal, T=T, vector_of=e[3:])
        else:
            program.add(ik_step.turn_to, goal=goal, T=T, room=program.rows(16), vector_of=e[3:])
        program.add(
            ik_step.residual,
            goal=goal,
            T=T,
            weights=weights,
            e=e,
            error=state[turns.ERROR],
            squared=state[turns.SQUARE],
            boost=state[turns.BOOST],
            damping=damping,
        )
        moves = self.tree.moves(self.tree.carried(self.arm.link), self.arm.columns)
        J = self.placed.base_jacobian(T, moves)
        if self.pointing:
            program.add(ik_step.ignore_roll, T=T, J=J)
        if (self.weight != 1.0).any():
            program.add(weigh, A=J, weights=weights, B=J)
        return e, damping, J

    def _propose(self, rows: tuple[Rows, Rows, Rows]) -> None:
        """Add the stages of the next step."""
        (e, damping, J), n, program = rows, self.n, self.program
        downhill, room = program.rows(n), program.rows(normal.room_of(6, n))
        program.add(transpose, A=J, y=e, x=downhill)
        given, state = {"J": J, "downhill": downhill}, self.state
        program.add(ik_step.hold, **given, stopped=state[turns.HELD], joints=self._held())
        program.add(
            normal.damped_step, A=J, y=e, downhill=downhill, damping=damping, x=self.step, room=room
        )
        program.add(
            ik_step.judge,
            **given,
            qd=self.step,
            squared=state[turns.SQUARE],
            gained=state[turns.GAIN],
            still=state[turns.STILL],
        )
        program.add(turns.next_turn, qd=self.step)
        program.add(turns.adapt_damping)

    def _held(self) -> list[tuple[int, Rows, Rows]]:
        """Return of each joint that a limit may hold its column, its coordinate, its limits."""
        found, (row, *limits, turns) = [], self.arm.bounds
        low, high = (values.tolist() for values in limits)
        for j, i in enumerate(row.tolist()):
            if i in self._limits and not (turns[i] and high[i] - low[i] >= 2.0 * math.pi):
                found.append((j, self.q[i], self._limits[i]))
        return found
