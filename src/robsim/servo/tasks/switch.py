"""A task that switches between two schemes on a condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Self, cast

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
from robsim.servo.tasks.task import Task, TaskLike
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene


@register("task", "switch")
@dataclass(frozen=True, eq=False)
class Switch(CompositeTask):
    """Switch from one scheme to a second scheme once a condition holds.

    A typical pair is `PBVS` far from the goal, for a straight path, and `IBVS` near it, for its
    accuracy; or `PBVS` until a mark comes near the border of the image. The command jumps at the
    switch; `Safety(acceleration=...)` bounds the jump.

    With `latch` a run switches once. Without `latch` the condition is evaluated at every instant,
    and the run may switch back (a switched system, as in Gans and Hutchinson 2007); chattering is
    possible then.

    Raises
    ------
    InputError
        By `simulate`, if a condition of a user returns anything but truth values (B,).

    Notes
    -----
    A run has converged if the errors of both schemes are small, so the two schemes need a common
    goal. A trajectory in either scheme runs on the clock of the run, whichever scheme is active. A
    run ends if a mark of either scheme leaves its image, or if an error of either scheme is not
    finite.

    Examples
    --------
    PBVS loses the target; a switch near the border of the image keeps it:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("pbvs_loses_target"))
    >>> pbvs, ibvs = rs.PBVS(scenario.task.goal), rs.IBVS(scenario.task.goal)
    >>> for task in pbvs, rs.Switch(pbvs, ibvs, when=rs.tasks.NearBorder(60, (640, 480))):
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(rs.Outcome(int(run.outcome)).name)
    OUT_OF_IMAGE
    CONVERGED
    """

    first: Annotated[TaskLike, TaskChoice(TASKS, protocol=Task), "Scheme at the start."]
    second: Annotated[TaskLike, TaskChoice(TASKS, protocol=Task), "Scheme after the switch."]
    when: Annotated[
        Condition,
        CONDITION,
        "Condition of the switch: a kind, or an object with holds(first, second).",
    ]
    latch: Annotated[
        bool, Flag(), "Whether a run keeps the second scheme after the first switch."
    ] = True

    @property
    def placed(self) -> dict[TaskPath, Task]:
        """Tasks of the composition, by their paths."""
        return {("first",): cast(Task, self.first), ("second",): cast(Task, self.second)}

    def with_inner(self, tasks: Sequence[Task]) -> Self:
        """Return a copy with other tasks.

        Parameters
        ----------
        tasks : sequence of Task
            First and second scheme.

        Returns
        -------
        Switch
            The copy.
        """
        first, second = tasks
        return replace(self, first=first, second=second)

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of both schemes in a scene; each scheme commands its own joints."""
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
    """Controller of two schemes, one of them active at a time."""

    when: Condition
    latch: bool

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of both schemes; joints of the inactive scheme stand still."""
        each, program = self._add_parts(inputs), inputs.program
        holds = self._add_condition(inputs, each)
        second = program.result(kernels.latch_switch, "second", latch=self.latch, condition=holds)
        qd = program.result(control_law.clear_rows, "rows", self.columns.size)
        for i, (part, one) in enumerate(zip(self.parts, each, strict=True)):
            to = [qd[column] for column in self._find_positions(part)]
            program.add(
                control_law.add_switched_velocity, qd=one.qd, second=second, scheme=i, to=to
            )
        status = _select_status(program, each, second)
        acting = [_switch_constraints(program, one, second, i) for i, one in enumerate(each)]
        return replace(self._merge_outputs(inputs, acting, qd), status=status)

    def _add_condition(self, inputs: ControllerInputs, each: list[ControllerOutputs]) -> BlockRows:
        """Return the row of the condition; a user's condition is evaluated in Python."""
        program, when = inputs.program, as_compiled_condition(self.when)
        images = [[inputs.views[sight.key].pixels for sight in part.sights] for part in self.parts]
        parts = list(zip(each, images, strict=True))
        if when is not None:
            return when.stages(program, *(SchemeRows(one.error, some) for one, some in parts))

        def ask(blocks: Blocks, step: int) -> Array:
            states = [_read_scheme_state(blocks, *part) for part in parts]
            return _evaluate_condition(self.when, states, blocks.runs).astype(float)

        return program.add_python_rows(ask)


def _switch_constraints(
    program: Program, one: ControllerOutputs, second: BlockRows, scheme: int
) -> ControllerOutputs:
    """Return the rows of a scheme, with constraints that act only while it commands."""
    if one.active is None or one.slack is None:
        return one
    switched = []
    for rows in (one.active, one.slack):
        out = program.result(control_law.clear_rows, "rows", rows.size)
        program.add(
            control_law.add_switched_velocity, qd=rows, second=second, scheme=scheme, to=list(out)
        )
        switched.append(out)
    return replace(one, active=switched[0], slack=switched[1])


def _select_status(
    program: Program, each: Sequence[ControllerOutputs], second: BlockRows
) -> BlockRows | None:
    """Return the row of the status of the active scheme, or None if neither scheme has a status."""
    if all(one.status is None for one in each):
        return None
    (status,) = program.result(control_law.clear_rows, "rows", 1)
    for i, one in enumerate(each):
        if one.status is not None:
            program.add(
                control_law.add_switched_velocity,
                qd=one.status.flat,
                second=second,
                scheme=i,
                to=[status],
            )
    return status


def _read_scheme_state(
    blocks: Blocks, one: ControllerOutputs, images: Sequence[BlockRows]
) -> SchemeState:
    """Return the state of one scheme for a user's condition."""
    get = blocks.get
    pixels = np.concatenate([np.empty((0, 2, blocks.runs)), *map(get, images)])
    arrays = get(one.s), get(one.error), get(one.qd), pixels
    return SchemeState(*map(make_read_only, arrays))


def _evaluate_condition(
    when: Condition, states: Sequence[SchemeState], runs: int
) -> NDArray[np.bool_]:
    """Return truth values (B,) from a condition; raise InputError for any other value."""
    value = when.holds(*states)
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
