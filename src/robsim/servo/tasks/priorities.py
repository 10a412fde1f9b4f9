"""Tasks in strict order of priority."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import repeat
from typing import Annotated, Any

from robsim.base.errors import InputError, format_value
from robsim.declare import ListOf, register
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.laws.inverse import RCOND_SPEC, PseudoInverse
from robsim.servo.laws.law import JointLaw
from robsim.servo.servo_controller import ServoController
from robsim.servo.servo_stages import ServoStages
from robsim.servo.shaping.command_fields import RedundancyFields, VelocityIndices
from robsim.servo.shaping.command_shaper import CommandShaper
from robsim.servo.shaping.redundancy import add_priorities
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.composite import (
    CompositeController,
    TaskListFields,
    merge_controller_fields,
)
from robsim.servo.tasks.task import ServoTask, Task
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene

PRIORITY_LEVELS = ListOf(TaskChoice(TASKS, only=("ibvs", "pbvs", "hybrid"), protocol=Task), 2, 64)


@register("task", "priorities")
@dataclass(frozen=True, eq=False)
class Priorities(TaskListFields, RedundancyFields):
    """Tasks in strict order: none disturbs one that comes before it (Siciliano and Slotine 1991).

    The first are served exactly as far as the robot can, each next within what is left; their own
    features, gains, depths and feed-forward count, their laws are all "joint". `rcond` decides
    what is left.

    >>> from robsim import IBVS, PBVS
    >>> Priorities([IBVS(), PBVS()]).rcond
    1e-06
    """

    tasks: Annotated[
        Any,
        PRIORITY_LEVELS,
        "At least two servo tasks with the joint law, the most important first.",
    ]
    rcond: Annotated[
        float, RCOND_SPEC, "Share of the largest singular value below which one counts as zero."
    ] = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        for task in self.tasks:
            _check_priority_level(task)

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the velocities that any of the tasks commands."""
        return self.chosen(scene, super().columns(scene))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of all tasks in a scene."""
        columns = self.columns(scene) if columns is None else columns
        parts = self.bound(scene, repeat(columns, len(self.tasks)))
        shared = merge_controller_fields(parts) | {"rcond": self.rcond}
        shaping = self.shaping(scene, columns)
        return PriorityController(**shared, columns=columns, parts=parts, shaping=shaping)


def _check_priority_level(task: Any) -> None:
    """Raise InputError for a task whose law is not "joint", or with what the whole command has."""
    servo = isinstance(task, ServoTask) and type(task).bound_law is ServoTask.bound_law
    if not servo or type(task.law) is not JointLaw:
        raise InputError(
            "priorities are for tasks such as IBVS, PBVS and Hybrid with law='joint', "
            f"got {format_value(task)}"
        )
    if task.joints or task.secondary or task.smooth_start or task.limit:
        raise InputError(
            "joints, secondary, smooth_start and limit belong to Priorities(...) as a "
            "whole, not to one of its tasks"
        )
    if task.inverse != PseudoInverse():
        raise InputError(
            "inverse: priorities invert what each task has left by rcond of Priorities(...), not "
            "by an inverse of the task: leave it out"
        )


@dataclass(frozen=True, eq=False)
class PriorityController(CompositeController):
    """The controller of tasks in strict order."""

    parts: tuple[ServoController, ...]
    shaping: CommandShaper

    def stages(self, given: ControllerInputs) -> ControllerOutputs:
        """Add the stages in which each task moves within what those before leave free."""
        made = [ServoStages(part, given.inside(str(i))) for i, part in enumerate(self.parts)]
        for one in made:
            one.assess()
        qd, _ = add_priorities(given.program, [(one.A, one.rate()) for one in made], self.rcond)
        found = self._together(given, [one.commanded(qd) for one in made], qd)
        task = found.error, made[0].of.first, found.task_jacobian
        return replace(found, qd=self.shaping.stages(given, qd, *task))
