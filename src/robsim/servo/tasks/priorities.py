"""Tasks in strict order of priority."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Annotated, Any, cast

from robsim.base.errors import InputError, format_value
from robsim.declare import KindOf, ListOf, register
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.constraints.constraint import ConstraintPlace, MarkView
from robsim.servo.constraints.constraint_stages import BoundConstraints, ConstraintStages
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.laws.constrained_law import ConstrainedLaw
from robsim.servo.laws.inverse import RCOND_SPEC, PseudoInverse
from robsim.servo.laws.law import LAWS, JointLaw, Law, LawLike
from robsim.servo.servo_controller import ServoController
from robsim.servo.servo_stages import ServoStages
from robsim.servo.shaping.command_fields import RedundancyFields, VelocityIndices
from robsim.servo.shaping.command_shaper import CommandShaper
from robsim.servo.shaping.free_motions import FreeMotions, add_camera_priorities, add_priorities
from robsim.servo.shaping.row_space import RowSpace
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.composite import (
    CompositeController,
    TaskListFields,
    merge_controller_fields,
)
from robsim.servo.tasks.task import ServoTask, Task, TaskLike
from robsim.servo.tasks.task_choice import TASKS, TaskChoice
from robsim.world.scene import Scene

PRIORITY_LEVELS = ListOf(TaskChoice(TASKS, only=("ibvs", "pbvs", "hybrid"), protocol=Task), 2, 64)


@register("task", "priorities")
@dataclass(frozen=True, eq=False)
class Priorities(TaskListFields, RedundancyFields):
    """Several servo tasks in strict order: no task disturbs a task before it.

    Task i requires A_i qdot = rate_i, with its task Jacobian A_i = L J and rate_i = -gain e_i. It
    gets the least-squares solution within the motions that the tasks before it leave free,

        qdot_i = qdot_(i-1) + (A_i P_(i-1))^+ (rate_i - A_i qdot_(i-1))
        P_i    = P_(i-1) - (A_i P_(i-1))^+ (A_i P_(i-1)),

    from qdot_0 = 0 and P_0 = I (Siciliano and Slotine 1991; Baerlocher and Boulic 1998). The first
    task converges as it would alone; the last task takes the motions that remain. Put the task that
    must never fail first, such as keeping the target in the centre of the image, and the pose
    second.

    Features, gain, depth and feed-forward belong to each task, and the law of each is "joint".
    `joints`, `secondary`, `smooth_start`, `limit` and the constraints of a `ConstrainedLaw` belong
    to the whole. A larger `rcond` leaves weak
    motions of a task to the next task.

    Raises
    ------
    InputError
        If a task is no servo task with the joint law, or has a field that belongs to the whole.

    Examples
    --------
    A camera first centres the target, and uses the remaining motions for the pose:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("mobile_arm"))
    >>> centroid = rs.features.FeatureBlock("point_moments", components=[1, 2])
    >>> centre = rs.IBVS(features=centroid, gain=3)
    >>> task = rs.Priorities([centre, rs.PBVS()])
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    >>> rs.Outcome(int(run.outcome)).name
    'CONVERGED'
    """

    tasks: Annotated[
        Sequence[TaskLike],
        PRIORITY_LEVELS,
        "Two or more servo tasks with the joint law, the most important first.",
    ]
    rcond: Annotated[
        float, RCOND_SPEC, "Relative size below which a singular value of a task counts as zero."
    ] = 1e-6
    law: Annotated[
        LawLike,
        KindOf(LAWS, default="joint", only=("joint", "constrained"), protocol=Law),
        "Law of the whole: joint, or constrained with the joint law.",
    ] = "joint"

    def __post_init__(self) -> None:
        super().__post_init__()
        for task in self.tasks:
            _check_priority_level(task)
        inner = self.law.law if isinstance(self.law, ConstrainedLaw) else self.law
        if type(inner) is not JointLaw:
            raise InputError(
                "law: tasks in strict order need law='joint', alone or in a ConstrainedLaw, got "
                f"{format_value(self.law)}"
            )

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the velocities that any of the tasks commands."""
        return self.select_velocities(scene, super().columns(scene))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of all tasks in a scene."""
        columns = self.columns(scene) if columns is None else columns
        bound = self.bound(scene, repeat(columns, len(self.tasks)))
        parts = cast(tuple[ServoController, ...], bound)
        shared = merge_controller_fields(parts) | {"rcond": self.rcond}
        shaping, constraints = self.shaping(scene, columns), None
        if isinstance(self.law, ConstrainedLaw):
            constraints = self.law.bind_constraints(_place_constraints(parts, columns))
        return PriorityController(
            **shared, columns=columns, parts=parts, shaping=shaping, constraints=constraints
        )


def _place_constraints(
    parts: Sequence[ServoController], columns: VelocityIndices
) -> ConstraintPlace:
    """Return the scene of constraints on all tasks, each pair as its first task believes it."""
    sights: dict[PairKey, CameraTarget] = {}
    for part in parts:
        for sight in part.bound_features.marked_sights:
            sights.setdefault(sight.key, sight)
    return ConstraintPlace(parts[0].bound_features.sights[0].scene, (*sights.values(),), columns)


def _check_priority_level(task: Any) -> None:
    """Raise InputError for a task without the joint law, or with a field of the whole command."""
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
            "inverse: Priorities(...) inverts the task Jacobians with its own rcond: leave the "
            "inverse of the task out"
        )


@dataclass(frozen=True, eq=False)
class PriorityController(CompositeController):
    """Controller of tasks in strict order."""

    parts: tuple[ServoController, ...]
    shaping: CommandShaper
    constraints: BoundConstraints | None = None

    @property
    def constraint_labels(self) -> tuple[str, ...]:
        """Names of the constraints of the law."""
        return self.constraints.labels if self.constraints else ()

    def stages(self, inputs: ControllerInputs) -> ControllerOutputs:
        """Add the stages of all tasks, each within the free motions of the tasks before it."""
        levels = [
            ServoStages(part, inputs.select_task(str(i))) for i, part in enumerate(self.parts)
        ]
        for one in levels:
            one.assess()
        qd, free = self._add_levels(inputs.program, levels)
        outputs = self._merge_outputs(inputs, [one.outputs(qd) for one in levels], qd)
        task = outputs.error, levels[0].feature_rows.first_jacobian, outputs.task_jacobian
        shaped = self.shaping.stages(inputs, qd, *task, lambda: free)
        outputs = replace(outputs, qd=shaped)
        return self._constrain(inputs, levels, outputs) if self.constraints else outputs

    def _add_levels(
        self, program: Program, levels: list[ServoStages]
    ) -> tuple[BlockRows, FreeMotions]:
        """Add the stages of the command of all tasks; return its rows and the free motions."""
        rates = [one.rate() for one in levels]
        J = levels[0].feature_rows.first_jacobian
        if J.shape[1] <= 6 or not self._is_one_motion:
            tasks = [one.A for one in levels]
            return add_priorities(program, list(zip(tasks, rates, strict=True)), self.rcond)
        tasks = [one.L for one in levels]
        space = RowSpace.of(program, J)
        return add_camera_priorities(space, list(zip(tasks, rates, strict=True)), self.rcond)

    @property
    def _is_one_motion(self) -> bool:
        """Whether the task Jacobians are products of an L each and the same J."""
        bound = [part.bound_features for part in self.parts]
        same_pair = len({each.sights[0].key for each in bound}) == 1
        exact = all(each.exact for each in bound)
        return same_pair and exact and all(part.one_motion for part in self.parts)

    def _constrain(
        self, inputs: ControllerInputs, levels: list[ServoStages], outputs: ControllerOutputs
    ) -> ControllerOutputs:
        """Return the rows with a command that satisfies the constraints."""
        assert self.constraints is not None
        views: dict[PairKey, MarkView] = {}
        for one in levels:
            for key, view in one.feature_rows.views().items():
                views.setdefault(key, view)
        rows = inputs, levels[0].feature_rows.placed, views, outputs.qd, outputs.task_jacobian
        limited, note_tasks = ConstraintStages(self.constraints, *rows), outputs.note

        def note(qd: BlockRows) -> None:
            limited.note(qd)
            note_tasks(qd)

        active, slack = limited.active, limited.slack
        return replace(outputs, qd=limited.qd, note=note, active=active, slack=slack)
