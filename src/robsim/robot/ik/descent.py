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
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.assembly import integers
from robsim.robot.ik.arm import Arm
from robsim.robot.motion import add_motion
from robsim.robot.placed import Placed, add_base_jacobian


class Descent:
    """A search for the coordinates of an arm, by what of a pose counts.

    `weight` (6,) is of the rows (v, omega) in the axes of the base; if `pointing`, the rotation
    counts only where the z axis points. The program takes a step, and proposes the next.
    """

    def __init__(self, arm: Arm, weight: Array, pointing: bool) -> None:
        self.arm, self.weight, self.pointing = arm, weight, pointing
        self.tree, self.n = arm.tree, len(arm.columns)
        self.program = Program()
        self.program.rows(turns.Q)
        self.q = self.program.rows(self.tree.nq)
        self.step = self.program.rows(self.n)
        self.placed = Placed(self.program, self.tree.joints, self.q, self.tree.nq)
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
        program, rates = self.program, np.full(self.tree.nv, -1)
        rates[self.arm.columns] = self.step + np.arange(self.n)
        add_motion(program, self.tree.joints, self.q, rates, program.constant(1.0))
        if not self.tree.compiled:
            program.call(self._advance)
        numbers: list[int] = []
        for i, limits in self._limits.items():
            numbers += [self.q + i, limits, int(self.arm.bounds.turns[i])]
        program.add(ik_step.confine, len(self._limits), *numbers)
        if not self.tree.compiled:
            program.call(self._prepare)
        self.placed.add()

    def _measure(self) -> tuple[int, int, int]:
        """Add the stages of the error and the Jacobian; return their rows, and of the damping."""
        program, goal = self.program, turns.GOAL
        (T,) = self.placed.frames([self.arm.place])
        e, damping, weights = program.rows(6), program.rows(), program.constant(self.weight)
        if self.pointing:
            program.add(ik_step.point_to, goal, T, e + 3)
        else:
            program.add(ik_step.turn_to, goal, T, program.rows(16), e + 3)
        numbers = turns.ERROR, turns.SQUARE, turns.BOOST, damping
        program.add(ik_step.residual, goal, T, weights, e, *numbers)
        moves = self.tree.moves(self.tree.carried(self.arm.link), self.arm.columns)
        J = add_base_jacobian(program, self.placed.poses, self.placed.ratio, T, moves)
        if self.pointing:
            program.add(ik_step.ignore_roll, T, self.n, J)
        if (self.weight != 1.0).any():
            program.add(weigh, J, 6, self.n, weights, J)
        return e, damping, J

    def _propose(self, rows: tuple[int, int, int]) -> None:
        """Add the stages of the next step."""
        (e, damping, J), n, program = rows, self.n, self.program
        downhill, room = program.rows(n), program.rows(normal.room_of(6, n))
        program.add(transpose, J, 6, n, e, downhill)
        held = self._held()
        program.add(ik_step.hold, n, J, downhill, turns.HELD, len(held) // 3, *held)
        program.add(normal.damped_step, J, 6, n, e, downhill, damping, self.step, room)
        judged = turns.SQUARE, turns.GAIN, turns.STILL
        program.add(ik_step.judge, n, J, downhill, self.step, *judged)
        program.add(turns.next_turn, self.step, n)
        program.add(turns.adapt_damping)

    def _held(self) -> list[int]:
        """Return of each joint that a limit may hold its column, its coordinate, its limits."""
        found, (row, *limits, turns) = [], self.arm.bounds
        low, high = (values.tolist() for values in limits)
        for j, i in enumerate(row.tolist()):
            if i in self._limits and not (turns[i] and high[i] - low[i] >= 2.0 * math.pi):
                found += [j, self.q + i, self._limits[i]]
        return found

    def _advance(self, blocks: Blocks, step: int) -> None:
        """Move joints of the user's kinds."""
        q, v = blocks.get(self.q, self.tree.nq), np.zeros((self.tree.nv, blocks.runs))
        v[self.arm.columns] = blocks.get(self.step, self.n)
        for each in self.tree.own:
            each.advance(q, v, 1.0)
        blocks.put(self.q, q)

    def _prepare(self, blocks: Blocks, step: int) -> None:
        """Write the motions and twists of joints of the user's kinds."""
        self.placed.prepare(self.tree.own, blocks)
