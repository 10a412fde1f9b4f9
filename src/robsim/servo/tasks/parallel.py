"""Tasks that run side by side, each with its own joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import make_read_only
from robsim.base.errors import InputError
from robsim.declare import ListOf, register
from robsim.kernels.control import control_law
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.shaping.command_fields import VelocityIndices
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.composite import (
    SeparateJointsController,
    TaskListFields,
    merge_controller_fields,
)
from robsim.servo.tasks.task import Task, TaskLike
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene


@register("task", "parallel")
@dataclass(frozen=True, eq=False)
class Parallel(TaskListFields):
    """Several tasks side by side, each with its own joints: a head that watches, an arm that works.

    Each task commands its own joints; the motion of the other joints disturbs its features like a
    motion of the target. Give every task its `joints` if cameras and targets would let two tasks
    share a joint.

    A run has converged when all tasks have. If a task follows a trajectory, no run ends as
    converged or stalled before the trajectory ends, and no run ends because its error grows.

    Raises
    ------
    InputError
        By `simulate`, if two tasks command one joint.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("second_robot"))
    >>> watch = rs.IBVS(joints="watcher")
    >>> move = rs.FollowJoints(by={"worker.shoulder": 0.1}, duration=2.0)
    >>> run = rs.simulate(scenario.scene, rs.Parallel([watch, move]), scenario.start, duration=20)
    >>> rs.Outcome(int(run.outcome)).name
    'CONVERGED'
    """

    tasks: Annotated[
        Sequence[TaskLike],
        ListOf(TaskChoice(TASKS, protocol=Task), 2, 64),
        "Two or more tasks that command different joints.",
    ]

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the velocities that the tasks command.

        Raises InputError if two tasks command one joint.
        """
        every, counts = np.unique(np.concatenate(self.each_columns(scene)), return_counts=True)
        if (counts > 1).any():
            names = ", ".join(scene.velocity_names[i] for i in every[counts > 1])
            raise InputError(
                f"two tasks command one joint: {names}; give each task its own joints=..., or put "
                "them in order with Priorities"
            )
        return make_read_only(every)

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of all tasks in a scene."""
        mine = self.columns(scene)
        parts = self.bound(scene, self.each_columns(scene))
        return ParallelController(**merge_controller_fields(parts), columns=mine, parts=parts)


@dataclass(frozen=True, eq=False)
class ParallelController(SeparateJointsController):
    """Controller of tasks side by side."""

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of all tasks; each task commands its own joints."""
        each, qd = self._add_parts(inputs), inputs.program.rows(self.columns.size)
        for part, one in zip(self.parts, each, strict=True):
            inputs.program.add(
                control_law.widen_matrix,
                A=one.qd.reshape(1, -1),
                out=qd.reshape(1, -1),
                columns=self._find_positions(part).tolist(),
            )
        return self._merge_outputs(inputs, each, qd)
