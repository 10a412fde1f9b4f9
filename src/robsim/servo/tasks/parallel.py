"""Tasks side by side, each with joints of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

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
from robsim.servo.tasks.task import Task
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene


@register("task", "parallel")
@dataclass(frozen=True, eq=False)
class Parallel(TaskListFields):
    """Tasks side by side, each with joints of its own: a head that watches, an arm that works.

    Give each task its `joints` where the cameras and targets would let them share some. Beside one
    that follows a trajectory no run has converged or stalled before that is over, and none diverges
    because its error grows.

    >>> from robsim import IBVS, PBVS
    >>> Parallel([IBVS(joints="head"), PBVS(joints="arm")]).tasks[0].joints
    ('head',)
    """

    tasks: Annotated[
        Any,
        ListOf(TaskChoice(TASKS, protocol=Task), 2, 64),
        "At least two tasks, which command different joints.",
    ]

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the velocities that the tasks command; InputError if two command one joint."""
        every, counts = np.unique(np.concatenate(self.each_columns(scene)), return_counts=True)
        if (counts > 1).any():
            names = ", ".join(scene.velocity_names[i] for i in every[counts > 1])
            raise InputError(
                f"two tasks command one joint: {names}; tell them apart with joints=..., or put "
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
    """The controller of tasks side by side."""

    def stages(self, given: ControllerInputs) -> ControllerOutputs:
        """Add the stages of all tasks, each of which commands its own joints."""
        each, qd = self._parts(given), given.program.rows(self.columns.size)
        for part, one in zip(self.parts, each, strict=True):
            given.program.add(
                control_law.widen_matrix,
                A=one.qd.reshape(1, -1),
                out=qd.reshape(1, -1),
                columns=self._own(part).tolist(),
            )
        return self._together(given, each, qd)
