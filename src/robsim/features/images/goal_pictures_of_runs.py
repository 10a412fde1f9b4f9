"""The preparation of a feature for the picture at the goal, once for each picture."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.features.feature import Observation
from robsim.features.images.dense_feature import NormalEquations
from robsim.vision.camera import Camera

Prepared = TypeVar("Prepared")


class GoalPicture(NamedTuple):
    """The picture at the goal of a run.

    Attributes
    ----------
    camera : Camera
        Camera of the run.
    picture : ndarray of uint8, shape (h, w)
        Grey values.
    inverse_depth : ndarray of shape (3,)
        Coefficients of the inverse depth of the plane of the target, in 1/m.
    """

    camera: Camera
    picture: NDArray[np.uint8]
    inverse_depth: Array


class PreparedGoals(ABC, Generic[Prepared]):
    """Base of features that prepare each picture at the goal once, at its first use."""

    goal: Observation | None

    @abstractmethod
    def prepare_goal(self, shown: GoalPicture) -> Prepared:
        """Return the numbers of the feature for a picture at the goal."""

    def split_runs(self, seen: Observation) -> Iterator[tuple[slice, Prepared]]:
        """Yield slices of runs with one goal, and the numbers prepared for this goal.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        goal = self.goal
        if seen.pictures is None or goal is None or goal.pictures is None:
            missing = "pictures" if seen.pictures is None else "a goal: call towards first"
            raise InputError(f"{type(self).__name__} needs {missing}")
        count = len(seen.pictures)
        numbers = self._number_goals(goal)
        if len(numbers) == 1:
            yield slice(0, count), self._find_prepared(goal, 0)
            return
        runs = np.arange(count) if seen.runs is None else seen.runs
        of_runs = numbers[runs]
        starts = np.flatnonzero(np.diff(of_runs, prepend=-1)).tolist()
        for first, end in zip(starts, [*starts[1:], count], strict=True):
            yield slice(first, end), self._find_prepared(goal, int(of_runs[first]))

    def _number_goals(self, goal: Observation) -> NDArray[np.int64]:
        """Return for each run (runs,) the first run with the same goal."""
        if "_numbers" not in vars(self):
            vars(self)["_numbers"] = _number_equal_goals(goal)
        numbers: NDArray[np.int64] = vars(self)["_numbers"]
        return numbers

    def _find_prepared(self, goal: Observation, run: int) -> Prepared:
        """Return the numbers prepared for the goal of a run, computed once."""
        known: dict[int, Any] = vars(self).setdefault("_prepared", {})
        if run not in known:
            known[run] = self.prepare_goal(_select_goal(goal, run))
        prepared: Prepared = known[run]
        return prepared


def _number_equal_goals(goal: Observation) -> NDArray[np.int64]:
    """Return for each run (runs,) the first run with the same picture, plane and camera."""
    assert goal.pictures is not None and goal.plane_last is not None
    sizes = len(goal.pictures), goal.plane_last.shape[1], goal.camera.rows.shape[1]
    numbers, first = np.zeros(max(sizes), dtype=np.int64), dict[bytes, int]()
    for run in range(len(numbers)):
        picture, plane, camera = (run if size > 1 else 0 for size in sizes)
        parts = goal.pictures[picture], goal.plane_last[:, plane], goal.camera.rows[:, camera]
        numbers[run] = first.setdefault(b"".join(part.tobytes() for part in parts), run)
    return numbers


def _select_goal(goal: Observation, run: int) -> GoalPicture:
    """Return the picture at the goal of a run; one picture or one plane belongs to all runs."""
    assert goal.pictures is not None and goal.plane_last is not None
    picture = goal.pictures[run if len(goal.pictures) > 1 else 0]
    plane = goal.plane_last[:, run if goal.plane_last.shape[1] > 1 else 0]
    return GoalPicture(goal.camera.of_run(run), picture, np.ascontiguousarray(plane))


def get_inverse_depth(seen: Observation) -> Array:
    """Return the coefficients (B, 3) of the inverse depth of the target in each picture."""
    assert seen.plane_last is not None
    return np.ascontiguousarray(seen.plane_last.T)


def make_equations(count: int) -> NormalEquations:
    """Return normal equations of `count` runs, to be filled."""
    return NormalEquations(np.empty((count, 6, 6)), np.empty((count, 6)), np.empty(count))
