"""A task that switches from one scheme to another on a condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.declare import Flag, register
from robsim.kernels.control import control_law
from robsim.kernels.control import task_switch as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.shaping.command_fields import VelocityIndices
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.composite import (
    CompositeTask,
    SeparateJointsController,
    TaskPath,
    merge_controller_fields,
)
from robsim.servo.tasks.conditions import (
    CONDITION,
    Condition,
    SchemeRows,
    SchemeState,
    as_compiled_condition,
)
from robsim.servo.tasks.task import Task
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene


@register("task", "switch")
@dataclass(frozen=True, eq=False)
class Switch(CompositeTask):
    """Use the first scheme, and from a condition on the second: PBVS far away, IBVS near.

    Without `latch` it is asked anew at every instant (a switched system as in Gans and Hutchinson
    2007).

    A run has converged when the errors of both are small: their goals must be one. The time of a
    trajectory that one of them follows is that of the run, whenever its turn comes.

    A mark of either scheme that leaves its image ends a run, and so does an error of either that is
    not finite.

    >>> from robsim import IBVS, PBVS
    >>> from robsim.tasks import ErrorBelow
    >>> Switch(PBVS(), IBVS(), ErrorBelow(0.1)).latch
    True
    """

    first: Annotated[Any, TaskChoice(TASKS, protocol=Task), "Scheme at the start."]
    second: Annotated[Any, TaskChoice(TASKS, protocol=Task), "Scheme after the switch."]
    when: Annotated[
        Any, CONDITION, "Condition of the switch: a kind, or an object with holds(first, second)."
    ]
    latch: Annotated[
        bool, Flag(), "Whether a run stays with the second scheme once it has switched."
    ] = True

    @property
    def placed(self) -> dict[TaskPath, Any]:
        """The tasks of which it is made, by their places."""
        return {("first",): self.first, ("second",): self.second}

    def with_inner(self, tasks: Sequence[Any]) -> Self:
        """Return a copy with other tasks in their places."""
        first, second = tasks
        return replace(self, first=first, second=second)

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of both schemes in a scene, each with its own joints."""
        mine = self.columns(scene)
        parts = self.bound(scene, self.each_columns(scene))
        return SwitchController(
            **merge_controller_fields(parts),
            columns=mine,
            parts=parts,
            when=self.when,
            latch=self.latch,
        )


@dataclass(frozen=True, eq=False)
class SwitchController(SeparateJointsController):
    """The controller of two schemes, one after the other."""

    when: Condition
    latch: bool

    def stages(self, given: ControllerInputs) -> ControllerOutputs:
        """Add the stages of both schemes; the joints of the one that waits stand still."""
        each, program = self._parts(given), given.program
        holds = self._condition(given, each)
        second = program.result(kernels.latch_switch, "second", stays=self.latch, holds=holds)
        qd = program.result(control_law.clear_rows, "rows", self.columns.size)
        for i, (part, one) in enumerate(zip(self.parts, each, strict=True)):
            to = [qd[column] for column in self._own(part)]
            program.add(control_law.add_switched_velocity, qd=one.qd, second=second, which=i, to=to)
        status = _select_status(program, each, second)
        return replace(self._together(given, each, qd), status=status)

    def _condition(self, given: ControllerInputs, each: list[ControllerOutputs]) -> BlockRows:
        """Return the row of the condition, which may be a user's."""
        program, when = given.program, as_compiled_condition(self.when)
        images = [[given.views[sight.key].pixels for sight in part.sights] for part in self.parts]
        parts = list(zip(each, images, strict=True))
        if when is not None:
            return when.stages(program, *(SchemeRows(one.error, some) for one, some in parts))

        def ask(blocks: Blocks, step: int) -> Array:
            seen = [_read_scheme_state(blocks, *part) for part in parts]
            return _evaluate_condition(self.when, seen, blocks.runs).astype(float)

        return program.asked(ask)


def _select_status(
    program: Program, each: Sequence[ControllerOutputs], second: BlockRows
) -> BlockRows | None:
    """Return the row of the status of the scheme whose turn it is, or None where none has one."""
    if all(one.status is None for one in each):
        return None
    (found,) = program.result(control_law.clear_rows, "rows", 1)
    for i, one in enumerate(each):
        if one.status is not None:
            program.add(
                control_law.add_switched_velocity,
                qd=one.status.flat,
                second=second,
                which=i,
                to=[found],
            )
    return found


def _read_scheme_state(
    blocks: Blocks, one: ControllerOutputs, images: Sequence[BlockRows]
) -> SchemeState:
    """Return what a condition of a user's is shown of one scheme."""
    get = blocks.get
    pixels = np.concatenate([np.empty((0, 2, blocks.runs)), *map(get, images)])
    seen = get(one.s), get(one.error), get(one.qd), pixels
    return SchemeState(*map(make_read_only, seen))


def _evaluate_condition(
    when: Condition, seen: Sequence[SchemeState], runs: int
) -> NDArray[np.bool_]:
    """Return truth values (B,) from a condition, which may be a user's."""
    value = when.holds(*seen)
    try:
        holds: NDArray[Any] = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        holds = np.empty(())
    if holds.shape != (runs,) or holds.dtype != np.bool_:
        raise InputError(
            f"{type(when).__name__}.holds: expected truth values of shape ({runs},), "
            f"got {format_value(value)}"
        )
    return holds
