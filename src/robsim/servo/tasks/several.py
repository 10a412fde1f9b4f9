"""The common part of controllers of several tasks at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.servo.controller import Controller, Decision
from robsim.servo.measurement import Measurement
from robsim.servo.shaping.shaped import Columns
from robsim.servo.sight import Key, Sight


@dataclass(frozen=True, eq=False)
class Several(Controller):
    """The controller of several tasks, each with joints of its own, which they may share."""

    parts: tuple[Controller, ...]

    def note(self, measurement: Measurement, basis: list[Decision], qd: Array) -> None:
        """Let each task remember what was commanded of its joints in the end."""
        for i, (part, one) in enumerate(zip(self.parts, basis, strict=True)):
            part.note(measurement.inside(str(i)), one.basis, qd[self._own(part)])

    def busy(self, measurement: Measurement) -> NDArray[np.bool_]:
        """Return (B,): in which runs any of the tasks is busy."""
        each = [part.busy(measurement.inside(str(i))) for i, part in enumerate(self.parts)]
        found: NDArray[np.bool_] = np.any(each, axis=0)
        return found

    def check_start(self, q0: Array) -> None:
        """Raise InputError if a task can be done from none of the starts q0 (B, nq)."""
        for part in self.parts:
            part.check_start(q0)

    def _own(self, part: Controller) -> Columns:
        """Return where the velocities of a part are among all that are commanded."""
        return np.searchsorted(self.columns, part.columns)

    def _all(self, measurement: Measurement) -> tuple[list[Decision], Array, Array, Array]:
        """Return the decision of each task, and s, error and task Jacobian of all, stacked."""
        each = [part.decide(measurement.inside(str(i))) for i, part in enumerate(self.parts)]
        task_jacobian, row = np.zeros((self.k, self.columns.size, measurement.runs)), 0
        for part, one in zip(self.parts, each, strict=True):
            task_jacobian[row : row + part.k, self._own(part)] = one.command.task_jacobian
            row += part.k
        s, error = (np.concatenate([getattr(d.command, n) for d in each]) for n in ("s", "error"))
        return each, s, error, task_jacobian


class OfTasks:
    """The part of a declaration that is made of `tasks`."""

    tasks: Any

    @property
    def inner(self) -> tuple[Any, ...]:
        """The tasks of which it is made."""
        return tuple(self.tasks)

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
            pixels.setdefault(sight.key, part.goal_pixels[start : start + marks])
            start += marks
    seeing = next((part for part in parts if part.sights), parts[0])
    return {
        "scene": seeing.scene,
        "frame": seeing.frame,
        "sights": tuple(sights.values()),
        "s_goal": np.concatenate([part.s_goal for part in parts]),
        "units": tuple(unit for part in parts for unit in part.units),
        "tolerances": np.concatenate([part.tolerances for part in parts]),
        "goal_pixels": np.concatenate([np.empty((0, 2)), *pixels.values()]),
        "pace": min(part.pace for part in parts),
        "full_rank": max(part.full_rank for part in parts),
        "rcond": min(part.rcond for part in parts),
    }


def union(columns: Iterable[Columns]) -> Columns:
    """Return every velocity once, in order."""
    return frozen(np.unique(np.concatenate(list(columns))))
