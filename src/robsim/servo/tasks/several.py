"""The common part of controllers of several tasks at once."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, Self, cast

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError
from robsim.declare import Declared
from robsim.declare.problems import under
from robsim.features.rows import joined, picked
from robsim.kernels.control import commanding
from robsim.kernels.control.weighting import worst
from robsim.kernels.machine.program import Program
from robsim.kernels.machine.rows import Rows
from robsim.servo.controller import Controller
from robsim.servo.given import Commanded, Given
from robsim.servo.shaping.shaped import Columns
from robsim.servo.sight import Key, Sight
from robsim.servo.tasks.family import check_nesting
from robsim.world.scene import Scene

MOST_FEATURES = 40_000
Place = tuple[str | int, ...]  # of a task in another: ("tasks", 2)


@dataclass(frozen=True, eq=False)
class OfParts(Controller):
    """The part of a controller that follows from the tasks of which it is made."""

    parts: tuple[Any, ...]

    @property
    def weighted(self) -> bool:
        """Whether the numbers of s of any task have weights that change."""
        return any(part.weighted for part in self.parts)

    @property
    def excused(self) -> frozenset[Key]:
        """The sights whose marks may leave the image, as all tasks that look at them say."""
        parts = self.parts
        wanted = {
            sight.key for one in parts for sight in one.sights if sight.key not in one.excused
        }
        return frozenset(key for one in parts for key in one.excused if key not in wanted)

    @property
    def whole(self) -> frozenset[Key]:
        """The sights of which a feature of any task needs all marks at once."""
        return frozenset().union(*(part.whole for part in self.parts))

    def check_start(self, q0: Array) -> None:
        """Raise InputError if a task can be done from none of the starts q0 (B, nq)."""
        for part in self.parts:
            part.check_start(q0)

    def _own(self, part: Controller) -> Columns:
        """Return where the velocities of a part are among all that are commanded."""
        return np.searchsorted(self.columns, part.columns)

    def _parts(self, given: Given) -> list[Commanded]:
        """Return the rows of each task, with a memory of its own."""
        return [part.stages(given.inside(str(i))) for i, part in enumerate(self.parts)]

    def _together(self, given: Given, each: list[Commanded], qd: Rows) -> Commanded:
        """Return the rows of all tasks, with the velocities that are commanded."""
        program, own = given.program, [self._own(part) for part in self.parts]
        s, error = (
            joined(program, [getattr(one, name) for one in each]) for name in ("s", "error")
        )
        both = list(zip(own, each, strict=True))
        A = joined(program, [self._wide(program, one, columns) for columns, one in both])
        busy = program.result(commanding.either, "out", rows=[one.busy for one in each])

        def note(qd: Rows) -> None:
            for columns, one in both:
                one.note(picked(program, qd, columns))

        return Commanded(s, error, qd, A, busy, each[0].J, note, *self._marks_used(program, each))

    def _wide(self, program: Program, one: Commanded, own: Columns) -> Rows:
        """Return the rows of how all velocities move the features of a part."""
        if own.size == self.columns.size:  # in the same order
            return one.task_jacobian
        shape, given = (one.s.size, self.columns.size), {"A": one.task_jacobian}
        return program.result(commanding.widened, "out", *shape, **given, columns=own.tolist())

    def _marks_used(
        self, program: Program, each: list[Commanded]
    ) -> tuple[Rows | None, Rows | None]:
        """Return the rows of the weights of all parts, and of the worst status of what is left."""
        weights, status = None, [one.status for one in each if one.status is not None]
        if self.weighted:
            ones = [program.constant(np.ones(one.s.size)) for one in each]
            pairs = zip(ones, each, strict=True)
            weights = joined(program, [w if e.weights is None else e.weights for w, e in pairs])
        if len(status) < 2:
            return weights, status[0] if status else None
        return weights, program.result(worst, "out", rows=status)


class Several(OfParts):
    """The controller of several tasks, each with joints of its own, which they may share."""


class OfSeveral(Declared):
    """The part of a declaration that is made of tasks."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_nesting(self)

    @property
    @abstractmethod
    def placed(self) -> dict[Place, Any]:
        """The tasks of which it is made, by their places."""

    @property
    def inner(self) -> tuple[Any, ...]:
        """The tasks of which it is made."""
        return tuple(self.placed.values())

    def each_columns(self, scene: Scene) -> list[Columns]:
        """Return the velocities that each task commands."""
        found = []
        for place, task in self.placed.items():
            with under(*place):
                found.append(task.columns(scene))
        return found

    def columns(self, scene: Scene) -> Columns:
        """Return the velocities that any of the tasks commands."""
        return frozen(np.unique(np.concatenate(self.each_columns(scene))))

    def bound(self, scene: Scene, columns: Iterable[Columns]) -> tuple[Any, ...]:
        """Return the controllers of all tasks, each with its columns."""
        made: list[Controller] = []
        for (place, task), own in zip(self.placed.items(), columns, strict=True):
            with under(*place):
                made.append(task.bind(scene, own))
                if sum(each.k for each in made) > MOST_FEATURES:
                    raise InputError(f"with those before more than {MOST_FEATURES} features")
        return tuple(made)


class OfTasks(OfSeveral):
    """The part of a declaration that is made of `tasks`."""

    tasks: Any

    @property
    def placed(self) -> dict[Place, Any]:
        """The tasks of which it is made, by their places."""
        return {("tasks", i): task for i, task in enumerate(self.tasks)}

    def with_inner(self, tasks: Sequence[Any]) -> Self:
        """Return a copy with other tasks in their places."""
        copy: Self = replace(cast(Any, self), tasks=tuple(tasks))
        return copy


def common(parts: Sequence[Controller]) -> dict[str, Any]:
    """Return the fields of a controller that several parts have in common."""
    sights: dict[Key, Sight] = {}
    pixels: dict[Key, Array] = {}
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
        "s_goal": beside([part.s_goal for part in parts], 0),
        "units": tuple(unit for part in parts for unit in part.units),
        "tolerances": np.concatenate([part.tolerances for part in parts]),
        "goal_pixels": beside([np.empty((0, 2)), *pixels.values()], -2),
        "pace": reduce(np.minimum, [part.pace for part in parts]),
        "full_rank": reduce(np.maximum, [part.full_rank for part in parts]),
        "rcond": min(part.rcond for part in parts),
    }


def beside(arrays: Sequence[Array], axis: int) -> Array:
    """Return arrays beside each other along an axis, some of which may have an axis of runs."""
    others = [list(array.shape) for array in arrays]
    sizes = [shape.pop(axis) for shape in others]
    common = np.broadcast_shapes(*map(tuple, others))
    at = axis if axis >= 0 else len(common) + 1 + axis
    shapes = ((*common[:at], size, *common[at:]) for size in sizes)
    pairs = zip(arrays, shapes, strict=True)
    return np.concatenate([np.broadcast_to(*pair) for pair in pairs], axis=axis)
