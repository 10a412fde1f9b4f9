"""The goal of a task: shown by the true camera, or computed from a pose by what is believed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen, numbers, runs_last
from robsim.base.errors import GoalError, InputError
from robsim.base.values import Value
from robsim.features import Observation
from robsim.geometry.pose import Pose, homogeneous, one_pose
from robsim.kernels import camera as kernels
from robsim.servo.sight import Sight, relative
from robsim.vision.camera import Visibility
from robsim.world.scene import Scene


def _kept(q: Any) -> Any:
    """A copy that nobody changes; whether it fits is checked against the scene."""
    if isinstance(q, Mapping):
        return {name: _kept(value) for name, value in q.items()}
    if isinstance(q, np.ndarray | list | tuple):
        try:
            return frozen(numbers(q, "goal q", ("nq",)))
        except InputError as error:
            raise GoalError(str(error)) from None
    return q


@dataclass(frozen=True, eq=False)
class TaughtGoal(Value):
    """The features that the true camera measures when the robot stands at `q`.

    What is shown can be reached, and wrong intrinsics leave no final error. `q` is as in
    `simulate`: an array, or {robot: q}; None is home.

    >>> TaughtGoal([0.1, 0.2]).q
    array([0.1, 0.2])
    """

    q: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", _kept(self.q))


@dataclass(frozen=True)
class GoalPose:
    """The features that the controller expects with the target at `T_c_o` in camera axes.

    They come from the believed camera and target; nobody promises that they can be reached.

    >>> GoalPose(Pose.at(0, 0, 0.5)).T_c_o.position
    array([0. , 0. , 0.5])
    """

    T_c_o: Pose

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_c_o", one_pose(self.T_c_o, "goal T_c_o"))


@dataclass(frozen=True, eq=False)
class GoalFeatures(Value):
    """The features that are wanted, as numbers s (k,): nobody has seen them.

    >>> GoalFeatures([0.1, 0.2]).s
    array([0.1, 0.2])
    """

    s: Any

    def __post_init__(self) -> None:
        s = numbers(self.s, "goal s", ("k",))
        if s.ndim != 1 or not s.size:
            raise GoalError(f"goal s: expected shape (k,), got {s.shape}")
        object.__setattr__(self, "s", frozen(s))


Goal = TaughtGoal | GoalPose | GoalFeatures


def as_goal(value: Any) -> Goal:
    """A goal from itself, or from the q at which it is shown."""
    return value if isinstance(value, Goal) else TaughtGoal(value)


def configuration(goal: Goal, scene: Scene) -> Array | None:
    """Coordinates (nq, 1) at which a goal is shown."""
    if not isinstance(goal, TaughtGoal):
        return None
    try:
        q = scene.coordinates(scene.home if goal.q is None else goal.q, "goal q")
    except InputError as error:
        raise GoalError(str(error)) from None
    if q.ndim != 1:
        raise GoalError(f"a goal is shown at one q of shape ({scene.nq},), got {q.shape}")
    return runs_last(q, 1)


def goal_observation(goal: Goal, truth: Sight, belief: Sight, first: Sight) -> Observation:
    """What is seen at the goal, at the true depth; GoalError if a mark is not in the image.

    A computed goal is the pose of the believed target of `first` in its camera; other sights
    follow from it where they move with that one. Of numbers that are given there is no image.
    """
    if isinstance(goal, GoalPose):
        return _computed(goal, belief, first)
    q = configuration(goal, truth.scene)
    if q is None:  # anything of the right shape
        q = runs_last(truth.scene.home, 1)
    true, believed = truth.project(q), belief.project(q)
    if isinstance(goal, TaughtGoal):
        _check_visible(truth, true.visibility[:, 0], "shown")
    T_c_o = relative(believed.T_w_c, believed.T_w_o)
    return belief.observation(true.pixels, true.depth, T_c_o)


def _computed(goal: GoalPose, belief: Sight, first: Sight) -> Observation:
    if not belief.moves_with(first):
        raise GoalError(
            f"camera '{belief.eye.name}' and '{belief.target.name}' do not move as "
            f"'{first.eye.name}' and '{first.target.name}' do, for which the goal is computed: "
            "show the goal at a q instead"
        )
    T_c_o = goal.T_c_o
    if belief is not first:
        here, there = (s.project(runs_last(s.scene.home, 1)) for s in (belief, first))
        T_c_f, T_f_o = relative(here.T_w_c, there.T_w_c), relative(there.T_w_o, here.T_w_o)
        T_c_o = _pose(T_c_f) @ T_c_o @ _pose(T_f_o)
    camera = belief.eye.camera
    X = runs_last(np.asarray(T_c_o @ belief.target.marks)[None], 2)
    pixels = np.empty((X.shape[0], 2, 1))
    kernels.project(X, camera.K, camera.lens, pixels)
    status = camera.visibility(X[..., 0], np.eye(4))
    _check_visible(belief, status, "computed")
    depth = np.ascontiguousarray(X[:, 2])
    return belief.observation(pixels, depth, runs_last(T_c_o.matrix[None, :3], 2))


def _pose(T: Array) -> Pose:
    return Pose(homogeneous(T)[0])


def _check_visible(sight: Sight, status: Any, how: str) -> None:
    for n, flag in enumerate(status):
        if flag != Visibility.IN_IMAGE:
            where = "behind" if flag == Visibility.BEHIND_CAMERA else "out of the image of"
            raise GoalError(
                f"the {how} goal puts mark {n} of '{sight.target.name}' {where} "
                f"camera '{sight.eye.name}'"
            )
