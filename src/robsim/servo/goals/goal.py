"""Goals of a task: taught with the true camera, computed from a pose, or given as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, as_floats, make_read_only, move_runs_last
from robsim.base.errors import GoalError, InputError
from robsim.base.value import Value
from robsim.declare.array_types import Numbers
from robsim.declare.joint_numbers import PerJoint, get_coordinate_axes
from robsim.declare.problems import prefix_path
from robsim.declare.spec import MISSING, Context, NoTextError, Raw
from robsim.declare.tables import Table, write_table
from robsim.features.feature import Observation
from robsim.geometry.pose import Pose, check_single_pose, homogeneous_matrix
from robsim.geometry.pose_table import FLAT_POSE, POSE
from robsim.robot.joints.floating_joint import FloatingJoint
from robsim.servo.camera_target import CameraTarget, compute_relative_pose
from robsim.vision.camera import Visibility
from robsim.world.scene import Scene

FLOATING_UNITS = FloatingJoint.units


def _copy_configuration(q: Any) -> Any:
    """Return a read-only copy of q; whether it fits is checked against the scene."""
    if isinstance(q, Mapping):
        return {name: _copy_configuration(value) for name, value in q.items()}
    if isinstance(q, np.ndarray | list | tuple):
        try:
            return make_read_only(as_floats(q, "goal q", ("nq",)))
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
        object.__setattr__(self, "q", _copy_configuration(self.q))


@dataclass(frozen=True)
class GoalPose:
    """The features that the controller expects with the target at `T_c_o` in camera axes.

    They come from the believed camera and target; nobody promises that they can be reached.

    >>> GoalPose(Pose.at(0, 0, 0.5)).T_c_o.position
    array([0. , 0. , 0.5])
    """

    T_c_o: Pose

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_c_o", check_single_pose(self.T_c_o, "goal T_c_o"))


@dataclass(frozen=True, eq=False)
class GoalFeatures(Value):
    """The wanted features as numbers s (k,), which no camera has measured.

    >>> GoalFeatures([0.1, 0.2]).s
    array([0.1, 0.2])
    """

    s: Any

    def __post_init__(self) -> None:
        s = as_floats(self.s, "goal s", ("k",))
        if s.ndim != 1 or not s.size:
            raise GoalError(f"goal s: expected shape (k,), got {s.shape}")
        object.__setattr__(self, "s", make_read_only(s))


Goal = TaughtGoal | GoalPose | GoalFeatures


@dataclass(frozen=True)
class GoalTable:
    """The table of a goal in a text: a configuration, a pose, or numbers."""

    rivals: ClassVar[Any] = ((("q",), ("pose",), ("computed",), ("s",)),)

    q: Annotated[
        Any,
        PerJoint(get_coordinate_axes),
        "Configuration at which the goal is shown, one number for each coordinate.",
    ] = None
    pose: Annotated[Pose | None, FLAT_POSE, "Pose of a free camera at which the goal is shown."] = (
        None
    )
    computed: Annotated[
        Pose | None,
        POSE,
        "Pose of the target in camera axes, T_c_o, from which the goal is computed.",
    ] = None
    s: Annotated[Any, Numbers(), "Features at the goal, as as_floats."] = None

    def made(self, c: Context) -> Goal:
        """Return the goal; InputError if it is said in several ways."""
        if self.s is not None:
            return GoalFeatures(self.s)
        if self.computed is not None:
            return GoalPose(self.computed)
        return TaughtGoal(parse_start(self.q, self.pose, c.facts.get("scene"), "goal q"))

    @classmethod
    def of(cls, value: Goal, c: Context) -> GoalTable:
        """Return the table of a goal."""
        if isinstance(value, GoalPose):
            return cls(computed=value.T_c_o)
        if isinstance(value, GoalFeatures):
            return cls(s=value.s)
        scene = c.facts.get("scene")
        if scene is None:
            return cls()
        if c.facts.get("by_hand"):
            return cls(*describe_start(value.q, scene))
        return cls(None if value.q is None else scene.coordinates(value.q, limits=False))


@dataclass(frozen=True)
class GoalSpec(Table):
    """A goal; in Python also the configuration q at which it is shown."""

    kind: Any = Goal
    says: type[Any] | None = GoalTable
    takes_none: ClassVar[bool] = True  # which is home
    phrase: ClassVar[str] = "a goal: q, a pose, computed or s"
    python_phrase: ClassVar[str] = "q (nq,), {robot: q}, a TaughtGoal, a GoalPose or GoalFeatures"

    def check(self, value: Any, what: str) -> Goal:
        return value if isinstance(value, Goal) else TaughtGoal(value)

    def written(self, value: Any, c: Context, key: str | None = None) -> dict[str, Raw]:
        if type(value) not in (TaughtGoal, GoalPose, GoalFeatures):
            raise NoTextError(f"{type(value).__name__} is Python code")
        return write_table(value, c.changing(MISSING), GoalTable)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if raw := self.write(value, c.at(name)):
            table[name] = raw


def parse_start(q: Any, pose: Pose | None, scene: Any, what: str) -> Any:
    """Return coordinates of the robots from a text; None (home) where it says nothing."""
    if scene is None or (q is None and pose is None):
        return None
    if pose is None:
        with prefix_path("q"):
            return scene.coordinates(q, what)
    if scene.coordinate_units != FLOATING_UNITS:
        names = ", ".join(scene.coordinate_names) or "no coordinates"
        raise InputError(f"a pose is for a scene whose only joint floats; give q, of {names}")
    return scene.coordinates(pose.q, what)


def describe_start(q: Any, scene: Scene) -> tuple[Array | None, Pose | None]:
    """Return the coordinates of a start, or its pose where the only joint of the scene floats."""
    at = np.asarray(scene.coordinates(scene.home if q is None else q, limits=False))
    if scene.coordinate_units != FLOATING_UNITS:
        return at, None
    return None, Pose.from_quaternion(at[:3], at[3:])


def find_goal_configuration(goal: Goal, scene: Scene, runs: int) -> Array | None:
    """Return coordinates (nq, runs) at which a goal is shown; None if it is not shown at any."""
    if not isinstance(goal, TaughtGoal):
        return None
    try:
        q = scene.coordinates(scene.home if goal.q is None else goal.q, "goal q")
    except InputError as error:
        raise GoalError(str(error)) from None
    if q.ndim != 1:
        raise GoalError(f"a goal is shown at one q of shape ({scene.nq},), got {q.shape}")
    return np.repeat(q[:, None], runs, axis=1)


def observe_goal(
    goal: Goal,
    q: Array | None,
    truth: CameraTarget,
    belief: CameraTarget,
    first: CameraTarget,
    runs: int,
) -> Observation:
    """Return what a camera sees at the goal, with true depths; GoalError if a mark is out of view.

    q (nq, runs) is the `find_goal_configuration` at which it is shown; there is more than one run where
    numbers differ from run to run.

    A computed goal is the pose of the believed target of `first` in its camera; other sights
    follow from it where they move with that one. Of numbers that are given there is no image.
    """
    if isinstance(goal, GoalPose):
        return _observe_computed_goal(goal, belief, first, runs)
    there = truth.home(runs) if q is None else q  # of numbers, anything of the right shape
    true = truth.project(there)
    believed = true if belief is truth else belief.project(there)
    if q is not None:
        _check_marks_visible(truth, true.visibility, "shown")
    T_c_o = compute_relative_pose(believed.T_w_c, believed.T_w_o)
    return belief.observation(true.pixels, true.depth, T_c_o)


def _observe_computed_goal(
    goal: GoalPose, belief: CameraTarget, first: CameraTarget, runs: int
) -> Observation:
    if not belief.moves_with(first):
        raise GoalError(
            f"camera '{belief.eye.name}' and '{belief.target.name}' do not move as "
            f"'{first.eye.name}' and '{first.target.name}' do, for which the goal is computed: "
            "show the goal at a q instead"
        )
    T_c_o = np.repeat(goal.T_c_o.matrix[:3, :, None], runs, axis=2)
    if belief is not first:
        here, there = (s.project(s.home(runs)) for s in (belief, first))
        T_c_f, T_f_o = (
            compute_relative_pose(here.T_w_c, there.T_w_c),
            compute_relative_pose(there.T_w_o, here.T_w_o),
        )
        T_c_o = move_runs_last(
            (_make_poses(T_c_f) @ goal.T_c_o @ _make_poses(T_f_o)).matrix[:, :3], 2
        )
    depth, pixels, status = belief.image(np.eye(3, 4)[..., None], T_c_o)
    _check_marks_visible(belief, status, "computed")
    return belief.observation(pixels, depth, T_c_o)


def _make_poses(T: Array) -> Pose:
    return Pose(homogeneous_matrix(T))


def _check_marks_visible(sight: CameraTarget, status: Any, how: str) -> None:
    """Raise GoalError for the first mark that is not in the image, (N, B), of any run."""
    for run, n in np.argwhere(status.T != Visibility.IN_IMAGE)[:1]:
        where = "behind" if status[n, run] == Visibility.BEHIND_CAMERA else "out of the image of"
        whose = f" of run {run}" if status.shape[1] > 1 else ""
        raise GoalError(
            f"the {how} goal{whose} puts mark {n} of '{sight.target.name}' {where} "
            f"camera '{sight.eye.name}'"
        )
