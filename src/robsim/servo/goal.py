"""The goal of a task: shown by the true camera, or computed from a pose by what is believed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.arrays import Array, frozen, numbers, runs_last
from robsim.camera import Visibility
from robsim.errors import GoalError, InputError
from robsim.kernels import camera as kernels
from robsim.pose import Pose, one_pose
from robsim.servo.sight import Sight
from robsim.value import Value


def _kept(q: Any) -> Any:
    """A copy that nobody changes; what it is worth is checked against the scene."""
    if isinstance(q, Mapping):
        return {name: _kept(value) for name, value in q.items()}
    if isinstance(q, np.ndarray | list | tuple):
        try:
            return frozen(numbers(q, "goal q", ("nq",)))
        except InputError as error:
            raise GoalError(str(error)) from None
    return q


@dataclass(frozen=True, eq=False)
class Shown(Value):
    """The features that the true camera measures when the robot stands at `q`.

    What is shown can be reached, and wrong intrinsics leave no final error. `q` is as in
    `simulate`: an array, or {robot: q}; None is home.

    >>> Shown([0.1, 0.2]).q
    array([0.1, 0.2])
    """

    q: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", _kept(self.q))


@dataclass(frozen=True)
class Computed:
    """The features that the controller expects with the target at `T_c_o` in camera axes.

    They come from the believed camera and target; nobody promises that they can be reached.

    >>> Computed(Pose.at(0, 0, 0.5)).T_c_o.position
    array([0. , 0. , 0.5])
    """

    T_c_o: Pose

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_c_o", one_pose(self.T_c_o, "goal T_c_o"))


def as_goal(value: Any) -> Shown | Computed:
    """A goal from itself, or from the q at which it is shown."""
    return value if isinstance(value, Shown | Computed) else Shown(value)


@dataclass(frozen=True)
class GoalView:
    """The marks at the goal: pixels (N, 2, 1), depth (N, 1), and q (nq, 1) where it was shown."""

    pixels: Array
    depth: Array
    q: Array | None


def view_of(goal: Shown | Computed, truth: Sight, belief: Sight) -> GoalView:
    """What is seen at the goal; GoalError if a mark is behind the camera or out of the image."""
    if isinstance(goal, Computed):
        return _computed(goal, belief)
    scene = truth.scene
    try:
        q = scene.coordinates(scene.home if goal.q is None else goal.q, "goal q")
    except InputError as error:
        raise GoalError(str(error)) from None
    if q.ndim != 1:
        raise GoalError(f"a goal is shown at one q of shape ({scene.nq},), got {q.shape}")
    look = truth.look(runs_last(q, 1))
    _check_visible(truth, look.visibility[:, 0], "shown")
    return GoalView(look.pixels, look.depth, runs_last(q, 1))


def _computed(goal: Computed, belief: Sight) -> GoalView:
    camera = belief.eye.camera
    X = runs_last(np.asarray(goal.T_c_o @ belief.target.marks)[None], 2)
    pixels = np.empty((X.shape[0], 2, 1))
    kernels.project(X, camera.K, camera.lens, pixels)
    status = camera.visibility(X[..., 0], np.eye(4))
    _check_visible(belief, status, "computed")
    return GoalView(pixels, np.ascontiguousarray(X[:, 2]), None)


def _check_visible(sight: Sight, status: Any, how: str) -> None:
    for n, flag in enumerate(status):
        if flag != Visibility.IN_IMAGE:
            where = "behind" if flag == Visibility.BEHIND_CAMERA else "out of the image of"
            raise GoalError(
                f"the {how} goal puts mark {n} of '{sight.target.name}' {where} "
                f"camera '{sight.eye.name}'"
            )
