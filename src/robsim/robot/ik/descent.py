"""Program of one step of numerical inverse kinematics."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.kernels.control.control_law import multiply_transpose, weight_matrix_rows
from robsim.kernels.inverse_kinematics import ik_actions as turns
from robsim.kernels.inverse_kinematics import ik_step
from robsim.kernels.linear_algebra import normal_equations
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.assembly import as_int64
from robsim.robot.fk_stages import FKStages
from robsim.robot.ik.arm import IKArm
from robsim.robot.integration_stages import add_integration, add_python_integration


class IKDescent:
    """Search for the coordinates of an arm, with weights of the pose error.

    The weights (6,) apply to the rows (v, omega) in axes of the base. If `pointing`, only the
    direction of the z axis counts, not the rotation about it. The program takes a step, evaluates
    the error, and computes the next step.
    """

    def __init__(self, arm: IKArm, weight: Array, pointing: bool) -> None:
        self.arm, self.weight, self.pointing = arm, weight, pointing
        self.tree, self.n = arm.tree, len(arm.columns)
        self.program = Program()
        self.state = self.program.rows(turns.Q)
        self.q = self.program.rows(self.tree.nq)
        self.step = self.program.rows(self.n)
        self.bodies = FKStages(self.program, self.tree.joints, self.q)
        self._limits = {
            int(i): self.program.constant([arm.bounds.low[i], arm.bounds.high[i]])
            for i in arm.bounds.row
            if i >= 0 and np.isfinite(arm.bounds.low[i])
        }
        self._add_step()
        self._add_next_step(self._add_error())

    @cached_property
    def prepared(self) -> tuple[Any, ...]:
        """Arguments of the compiled search."""
        return self.program.prepared()

    @cached_property
    def share(self) -> Array:
        """Weights (12,) of the squared entries of the difference of two poses."""
        weights = np.full((3, 4), (self.weight[3:] ** 2).sum() / 6.0)
        weights[:, : 2 if self.pointing else 0] = 0.0
        weights[:, 3] = self.weight[:3] ** 2
        return make_read_only(weights.ravel())

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """Rows of the coordinates that are random at the start of a further search."""
        return as_int64(self.arm.bounds.row[self.arm.bounds.row >= 0])

    def _add_step(self) -> None:
        """Add the stages that move the coordinates within their limits and place the bodies."""
        program, steps = self.program, dict(zip(self.arm.columns.tolist(), self.step, strict=True))
        rates = [steps.get(column) for column in range(self.tree.nv)]
        for add in (add_integration, add_python_integration):
            add(program, self.tree.joints, self.q, rates, program.constant(1.0))
        limits_of = self._limits.items()
        joints = [(self.q[i], limits, self.arm.bounds.turns[i]) for i, limits in limits_of]
        program.add(ik_step.confine_coordinates, joints=joints)
        self.bodies.add()

    def _add_error(self) -> tuple[BlockRows, BlockRows, BlockRows]:
        """Add the stages of error and Jacobian; return the rows of error, damping and Jacobian."""
        program, state = self.program, self.state
        goal = state[turns.GOAL : turns.GOAL + 12].reshape(3, 4)
        (T,) = self.bodies.frames([self.tree.find(self.arm.link)])
        e, damping, weights = program.rows(6), program.rows(), program.constant(self.weight)
        if self.pointing:
            program.add(ik_step.compute_axis_error, goal=goal, T=T, out=e[3:])
        else:
            program.add(ik_step.compute_rotation_error, goal=goal, T=T, out=e[3:])
        program.add(
            ik_step.compute_residual,
            goal=goal,
            T=T,
            weights=weights,
            e=e,
            error=state[turns.ERROR],
            squared=state[turns.SQUARE],
            boost=state[turns.BOOST],
            damping=damping,
        )
        moves = self.tree.moves(self.tree.flag_moves(self.arm.link), self.arm.columns)
        J = self.bodies.base_jacobian(T, moves)
        if self.pointing:
            program.add(ik_step.ignore_roll, T=T, J=J)
        if (self.weight != 1.0).any():
            program.add(weight_matrix_rows, A=J, weights=weights, B=J)
        return e, damping, J

    def _add_next_step(self, rows: tuple[BlockRows, BlockRows, BlockRows]) -> None:
        """Add the stages of the next step."""
        (e, damping, J), n, program = rows, self.n, self.program
        downhill, room = (
            program.rows(n),
            program.rows(normal_equations.count_damped_step_rows(6, n)),
        )
        program.add(multiply_transpose, A=J, y=e, x=downhill)
        arguments, state = {"J": J, "descent": downhill}, self.state
        program.add(
            ik_step.hold_limited_joints,
            **arguments,
            held_count=state[turns.HELD],
            joints=self._list_limited_joints(),
        )
        program.add(
            normal_equations.damped_step,
            A=J,
            y=e,
            descent=downhill,
            damping=damping,
            x=self.step,
            scratch=room,
        )
        program.add(
            ik_step.detect_stationary,
            **arguments,
            qd=self.step,
            squared=state[turns.SQUARE],
            predicted_decrease=state[turns.GAIN],
            stationary=state[turns.STILL],
        )
        program.add(turns.choose_action, qd=self.step)
        program.add(turns.adapt_damping)

    def _list_limited_joints(self) -> list[tuple[int, BlockRows, BlockRows]]:
        """Return column, coordinate and limits of each joint that a limit may hold."""
        joints, (row, *limits, turns) = [], self.arm.bounds
        low, high = (values.tolist() for values in limits)
        for j, i in enumerate(row.tolist()):
            if i in self._limits and not (turns[i] and high[i] - low[i] >= 2.0 * math.pi):
                joints.append((j, self.q[i], self._limits[i]))
        return joints
