"""Constraints bound to a scene, and the stages that apply them to a command."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.control import command_limits
from robsim.kernels.control.constrained_command import constrain_command, count_constraint_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.fk_stages import FKStages
from robsim.servo.camera_target import PairKey
from robsim.servo.constraints.constraint import (
    Constraint,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    JointConstraint,
    MarkView,
    RowConstraint,
    VelocityLimits,
    join_rows,
    make_velocity_limits,
)
from robsim.servo.constraints.row_names import number_repeated_names
from robsim.servo.controller_rows import ControllerInputs

PAST_PERIODS = 8  # last commands that bring an old image to the present
SLACK_PRICE = 1e4  # cost of a violated row, in units of the metric


@dataclass(frozen=True, eq=False)
class BoundConstraints:
    """Constraints with the scene in which they act.

    Attributes
    ----------
    constraints : tuple of Constraint
        Constraints of the law.
    place : ConstraintPlace
        Believed scene, camera-target pairs and commanded velocities.
    by_error : bool
        Whether the distance to the wish is measured by the features.
    joint_weight : float
        Weight of the distance of the velocities beside that of the features.
    """

    constraints: tuple[Constraint, ...]
    place: ConstraintPlace
    by_error: bool
    joint_weight: float

    @cached_property
    def joint_limits(self) -> VelocityLimits | None:
        """Limits of each velocity from all joint constraints; None without any."""
        joints = [one for one in self.constraints if isinstance(one, JointConstraint)]
        each = [one.limits(self.place) for one in joints]
        if not each:
            return None
        narrow: Any = np.minimum, np.minimum, np.maximum, np.minimum
        n = len(self.place.columns)
        return reduce(
            lambda a, b: VelocityLimits(*(f(x, y) for f, x, y in zip(narrow, a, b, strict=True))),
            each,
            make_velocity_limits(n),
        )

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Names of all constraints, in the order of the recorded rows."""
        names = [self.place.scene.velocity_names[i] for i in self.place.columns]
        ends = "lower", "upper"
        joints = [f"{name} at its {end} limit" for end in ends for name in names]
        rows = [name for each in self._row_names for name in each]
        return number_repeated_names([*(joints if self.joint_limits else ()), *rows])

    @cached_property
    def _row_names(self) -> list[list[str]]:
        """Names of the rows of each constraint; empty for joint constraints."""
        return [one.label(self.place) for one in self.constraints]

    def check(self) -> None:
        """Raise InputError if a constraint cannot act in the scene of a run."""
        for one in self.constraints:
            check = getattr(one, "check", None)
            if check is not None:
                check(self.place)

    @property
    def owners(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the constraints of each recorded row; joint constraints share their rows."""
        joints = tuple(
            i for i, one in enumerate(self.constraints) if isinstance(one, JointConstraint)
        )
        shared = [joints] * (2 * len(self.place.columns)) if self.joint_limits else []
        rows = [(i,) for i, names in enumerate(self._row_names) for _ in names]
        return (*shared, *rows)

    @property
    def levels(self) -> Array:
        """Level of each row."""
        pairs = zip(self.constraints, self._row_names, strict=True)
        each = [[one.level] * len(names) for one, names in pairs if isinstance(one, RowConstraint)]
        return np.concatenate([np.empty(0), *each])

    @cached_property
    def row_constraints(self) -> list[RowConstraint]:
        """Constraints with rows."""
        return [one for one in self.constraints if isinstance(one, RowConstraint)]


class ConstraintStages:
    """Command next to the wish of a law that satisfies constraints, and its rows.

    A (k, n) is the task Jacobian of the metric. `active` (c,) are the multipliers of all
    constraints, and `slack` (c,) is the excess over them.
    """

    def __init__(
        self,
        bound: BoundConstraints,
        inputs: ControllerInputs,
        placed: FKStages,
        views: Mapping[PairKey, MarkView],
        wish: BlockRows,
        A: BlockRows,
    ) -> None:
        place, program, n = bound.place, inputs.program, wish.size
        past = program.rows(PAST_PERIODS if inputs.age is not None else 1, n)
        rows = placed, views, wish, past
        self.bound, self.of = bound, ConstraintInputs(inputs, place.scene, place.columns, *rows)
        self.low, self.high = self._add_bounds()
        self.C, self.bounds = self._add_rows()
        m = self.bounds.size
        self.qd, multipliers, slack = (
            program.rows(n),
            program.rows(2 * n + m),
            program.rows(2 * n + m),
        )
        program.add(
            constrain_command,
            A=A if bound.by_error else program.constant(np.eye(n)),
            eps=program.constant(bound.joint_weight),
            wish=wish,
            low=self.low,
            high=self.high,
            C=self.C,
            bound=self.bounds,
            levels=program.constant(bound.levels),
            price=program.constant(SLACK_PRICE),
            qd=self.qd,
            multipliers=multipliers,
            slack=slack[2 * n :],
            unmet=program.rows(),
            scratch=program.scratch(count_constraint_rows(n, m)),
        )
        first = 0 if bound.joint_limits else 2 * n
        self.active, self.slack = multipliers[first:], slack[first:]

    def note(self, qd: BlockRows) -> None:
        """Add the stage that stores the final command, the newest of the past ones."""
        self.of.inputs.program.add(command_limits.remember_command, qd=qd, past=self.of.past)

    def _add_rows(self) -> ConstraintRows:
        """Add the stages of the rows of all constraints; return them in sequence."""
        each = [one.stages(self.of) for one in self.bound.row_constraints]
        if each:
            return join_rows(self.of, each)
        program, n = self.of.inputs.program, self.of.wish.size
        return ConstraintRows(program.rows(0, n), program.rows(0))

    def _add_bounds(self) -> tuple[BlockRows, BlockRows]:
        """Add the stage of the bounds of each velocity; return the rows of both bounds."""
        of, limits = self.of, self.bound.joint_limits
        program, n = of.inputs.program, of.wish.size
        if limits is None:
            return program.constant(np.full(n, -np.inf)), program.constant(np.full(n, np.inf))
        low, high = program.rows(n), program.rows(n)
        program.add(
            command_limits.bound_velocities,
            q=of.inputs.q,
            places=of.scene.tree.alone(of.columns).tolist(),
            last=of.past[0],
            dt=of.inputs.dt,
            hold=of.inputs.dt,
            speeds=program.constant(limits.speeds),
            accelerations=program.constant(limits.accelerations),
            least=program.constant(limits.low),
            most=program.constant(limits.high),
            low=low,
            high=high,
        )
        return low, high
