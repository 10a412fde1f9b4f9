"""Common parts of tasks and controllers that are composed of several tasks."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, Self, cast

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue
from robsim.declare.problems import prefix_path
from robsim.features.feature_rows import concatenate_rows, select_rows
from robsim.kernels.control import control_law
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.constraints.row_names import number_repeated_names
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.laws.command_quantity import CommandQuantity, check_equal_quantities
from robsim.servo.shaping.command_fields import VelocityIndices
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.task import Task, TaskLike
from robsim.servo.tasks.task_choice import check_nesting
from robsim.servo.weight_stages import add_maximum
from robsim.vision.detectors.mark_detector import MarkDetector
from robsim.world.scene import Scene

MAX_FEATURES = 40_000
TaskPath = tuple[str | int, ...]  # path of a task in another task, as ("tasks", 2)


@dataclass(frozen=True, eq=False)
class CompositeController(TaskController):
    """Base of controllers composed of the controllers of several tasks."""

    parts: tuple[TaskController, ...]

    @property
    def has_weights(self) -> bool:
        """Whether the components of s of any task have weights that change."""
        return any(part.has_weights for part in self.parts)

    @property
    def optional_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with marks that may leave the image, in every task of the pair."""
        parts = self.parts
        required = {
            sight.key
            for one in parts
            for sight in one.sights
            if sight.key not in one.optional_pairs
        }
        return frozenset(key for one in parts for key in one.optional_pairs if key not in required)

    @property
    def pictured_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature of whole pictures, in any task."""
        return frozenset().union(*(part.pictured_pairs for part in self.parts))

    @property
    def factor_count(self) -> int:
        """Number of entries of the factors of normal equations, in all tasks."""
        return sum(part.factor_count for part in self.parts)

    @property
    def command_quantity(self) -> CommandQuantity:
        """Quantity of the commands of all tasks."""
        return self.parts[0].command_quantity

    @property
    def constraint_labels(self) -> tuple[str, ...]:
        """Names of the constraints of all tasks."""
        return number_repeated_names([name for one in self.parts for name in one.constraint_labels])

    @property
    def believed_sights(self) -> Mapping[PairKey, CameraTarget]:
        """Believed camera-target pairs, each as its first task believes."""
        pairs = [part.believed_sights for part in reversed(self.parts)]
        return {key: sight for each in pairs for key, sight in each.items()}

    @property
    def detectors(self) -> Mapping[PairKey, MarkDetector]:
        """Detectors of the camera-target pairs of all tasks."""
        merged: dict[PairKey, MarkDetector | None] = {}
        for part in self.parts:
            for sight in part.sights:
                own = part.detectors.get(sight.key)
                if merged.setdefault(sight.key, own) != own:
                    camera, target = sight.key
                    raise InputError(
                        f"detector: the tasks detect '{target}' in camera '{camera}' in two ways; "
                        "give them the same detector"
                    )
        return {key: each for key, each in merged.items() if each is not None}

    @property
    def whole(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature, of any task, that needs all marks at once."""
        return frozenset().union(*(part.whole for part in self.parts))

    def check_start(self, q0: Array) -> None:
        """Raise InputError if a task is possible from none of the starts q0 (B, nq)."""
        for part in self.parts:
            part.check_start(q0)

    def _find_positions(self, part: TaskController) -> VelocityIndices:
        """Return the positions of a part's velocities among all commanded velocities."""
        return np.searchsorted(self.columns, part.columns)

    def _add_parts(self, inputs: ControllerInputs) -> list[ControllerOutputs]:
        """Return the rows of each task; each task has its own memory."""
        return [part.stages(inputs.select_task(str(i))) for i, part in enumerate(self.parts)]

    def _merge_outputs(
        self, inputs: ControllerInputs, each: list[ControllerOutputs], qd: BlockRows
    ) -> ControllerOutputs:
        """Return the rows of all tasks, with the commanded velocities qd."""
        program, own = inputs.program, [self._find_positions(part) for part in self.parts]
        s, error = (
            concatenate_rows(program, [getattr(one, name) for one in each])
            for name in ("s", "error")
        )
        pairs = list(zip(own, each, strict=True))
        A = concatenate_rows(
            program, [self._widen_jacobian(program, one, columns) for columns, one in pairs]
        )
        busy = program.result(control_law.compute_any, "out", rows=[one.busy for one in each])

        def note(qd: BlockRows) -> None:
            for columns, one in pairs:
                one.note(select_rows(program, qd, columns))

        factors, active, slack = (
            [rows for one in each if (rows := getattr(one, name)) is not None]
            for name in ("factors", "active", "slack")
        )
        return ControllerOutputs(
            s,
            error,
            qd,
            A,
            busy,
            each[0].J,
            note,
            *self._merge_weights(program, each),
            factors=concatenate_rows(program, factors) if factors else None,
            step=add_maximum(program, [one.step for one in each]),
            active=concatenate_rows(program, active) if active else None,
            slack=concatenate_rows(program, slack) if slack else None,
        )

    def _widen_jacobian(
        self, program: Program, one: ControllerOutputs, own: VelocityIndices
    ) -> BlockRows:
        """Return the rows of the task Jacobian of a part for all commanded velocities."""
        if own.size == self.columns.size:  # in the same order
            return one.task_jacobian
        shape, arguments = (one.s.size, self.columns.size), {"A": one.task_jacobian}
        return program.result(
            control_law.widen_matrix, "out", *shape, **arguments, columns=own.tolist()
        )

    def _merge_weights(
        self, program: Program, each: list[ControllerOutputs]
    ) -> tuple[BlockRows | None, BlockRows | None]:
        """Return the rows of the weights of all parts, and of the worst status of their images."""
        weights, status = None, add_maximum(program, [one.status for one in each])
        if self.has_weights:
            ones = [program.constant(np.ones(one.s.size)) for one in each]
            pairs = zip(ones, each, strict=True)
            weights = concatenate_rows(
                program, [w if e.weights is None else e.weights for w, e in pairs]
            )
        return weights, status


class SeparateJointsController(CompositeController):
    """Controller of several tasks with individual sets of joints, which may overlap."""


class CompositeTask(DeclaredValue):
    """Base of declared tasks that contain tasks."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_nesting(self)

    @property
    @abstractmethod
    def placed(self) -> dict[TaskPath, Task]:
        """Tasks of the composition, by their paths."""

    @property
    def inner(self) -> tuple[Task, ...]:
        """Tasks of the composition."""
        return tuple(self.placed.values())

    def each_columns(self, scene: Scene) -> list[VelocityIndices]:
        """Return the indices of the velocities that each task commands."""
        columns = []
        for path, task in self.placed.items():
            with prefix_path(*path):
                columns.append(task.columns(scene))
        return columns

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the velocities that any of the tasks commands."""
        return make_read_only(np.unique(np.concatenate(self.each_columns(scene))))

    def bound(self, scene: Scene, columns: Iterable[VelocityIndices]) -> tuple[TaskController, ...]:
        """Return the controllers of all tasks, each with its commanded velocities."""
        controllers: list[TaskController] = []
        for (path, task), own in zip(self.placed.items(), columns, strict=True):
            with prefix_path(*path):
                controllers.append(task.bind(scene, own))
                if sum(each.k for each in controllers) > MAX_FEATURES:
                    raise InputError(f"all tasks together have more than {MAX_FEATURES} features")
        check_equal_quantities([each.command_quantity for each in controllers])
        return tuple(controllers)


class TaskListFields(CompositeTask):
    """Base of declared tasks with a list `tasks`."""

    tasks: Sequence[TaskLike]

    @property
    def placed(self) -> dict[TaskPath, Task]:
        """Tasks of the composition, by their paths."""
        return {("tasks", i): cast(Task, task) for i, task in enumerate(self.tasks)}

    def with_inner(self, tasks: Sequence[Task]) -> Self:
        """Return a copy with other tasks.

        Parameters
        ----------
        tasks : sequence of Task
            Tasks in the order of `inner`.

        Returns
        -------
        Parallel or Priorities
            The copy.
        """
        copy: Self = replace(cast(Any, self), tasks=tuple(tasks))
        return copy


def merge_controller_fields(parts: Sequence[TaskController]) -> dict[str, Any]:
    """Return the fields of a composite controller that follow from its parts."""
    sights: dict[PairKey, CameraTarget] = {}
    pixels: dict[PairKey, Array] = {}
    for part in parts:
        start = 0
        for sight in part.sights:
            marks = len(sight.target.marks)
            sights.setdefault(sight.key, sight)
            pixels.setdefault(sight.key, part.goal_pixels[..., start : start + marks, :])
            start += marks
    seeing = next((part for part in parts if part.sights), parts[0])
    return {
        "scene": seeing.scene,
        "frame": seeing.frame,
        "sights": tuple(sights.values()),
        "s_goal": concatenate_with_runs([part.s_goal for part in parts], 0),
        "units": tuple(unit for part in parts for unit in part.units),
        "tolerances": np.concatenate([part.tolerances for part in parts]),
        "goal_pixels": concatenate_with_runs([np.empty((0, 2)), *pixels.values()], -2),
        "pace": reduce(np.minimum, [part.pace for part in parts]),
        "full_rank": reduce(np.maximum, [part.full_rank for part in parts]),
        "rcond": min(part.rcond for part in parts),
    }


def concatenate_with_runs(arrays: Sequence[Array], axis: int) -> Array:
    """Return arrays concatenated along an axis; some of them may have an axis of runs."""
    others = [list(array.shape) for array in arrays]
    sizes = [shape.pop(axis) for shape in others]
    common = np.broadcast_shapes(*map(tuple, others))
    at = axis if axis >= 0 else len(common) + 1 + axis
    shapes = ((*common[:at], size, *common[at:]) for size in sizes)
    pairs = zip(arrays, shapes, strict=True)
    return np.concatenate([np.broadcast_to(*pair) for pair in pairs], axis=axis)
