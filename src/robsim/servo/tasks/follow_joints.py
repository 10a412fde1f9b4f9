"""A task that follows a trajectory of the joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_float, as_floats, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.value import ReadOnlyDict
from robsim.declare import DeclaredValue, KindOf, Number, Time, register
from robsim.declare.context import Context, Raw
from robsim.declare.joint_numbers import Axes, PerJoint, get_followed_axes
from robsim.declare.problems import UnreadableValue
from robsim.declare.spec import make_expected_error
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import RCOND
from robsim.servo.shaping.command_fields import JOINT_NAMES, Joints, VelocityIndices
from robsim.servo.tasks.joint_follower import JointFollower, check_joint_goals
from robsim.servo.tasks.joint_names import JointIndices, find_joints, select_joints
from robsim.servo.tasks.trajectory_follower import (
    Trajectory,
    check_trajectory,
    make_cameraless_fields,
)
from robsim.trajectory.axis_limits import AxisAcceleration, AxisSpeed, Limits
from robsim.trajectory.time_law import TRAJECTORIES
from robsim.world.scene import Scene


@dataclass(frozen=True)
class JointGoal(PerJoint):
    """Goal of joints: {joint: number}, or a list with one number for each joint."""

    forms: ClassVar[tuple[str, ...]] = ("table", "list")
    python_phrase: ClassVar[str] = "{joint: number}, or an array (n,)"

    def check(self, value: Any, what: str) -> Any:
        return value  # the task checks it against its joints

    def read(self, raw: Raw, c: Context) -> Any:
        if raw == {}:
            raise make_expected_error("at least 1 joint", raw)
        return self.read_each(raw, c) if isinstance(raw, Mapping) else super().read(raw, c)

    def write(self, value: Any, c: Context) -> Any:
        if not isinstance(value, dict):
            return super().write(value, c)
        return dict(zip(value, super().write([*value.values()], c), strict=True))

    def schema(self, define: Any) -> dict[str, Any]:
        each = {"type": ["string", "number"]}
        return {"anyOf": [super().schema(define), {"type": "object", "additionalProperties": each}]}

    def _describe_list(self, words: str) -> str:
        return "{ joint = number } with units, or a list of one for each"


JointValues = Mapping[str, float] | ArrayLike  # {joint: number}, or numbers (n,)
GOAL_FIELDS = ("to", "by", "trajectory")  # fields that give the goal; one of them is required
TRAJECTORY = KindOf(TRAJECTORIES, short=False, protocol=object)


def _describe_axes(scene: Scene, axes: list[JointIndices]) -> Axes:
    """Return the units and names of the coordinates of joints."""
    at = [axis.coordinate for axis in axes]
    return Axes([scene.coordinate_units[i] for i in at], [scene.coordinate_names[i] for i in at])


@register("task", "follow_joints")
@dataclass(frozen=True, eq=False)
class FollowJoints(DeclaredValue):
    """Task that moves joints along a trajectory, without a camera.

    With the trajectory r(t) and the measured coordinates q, the commanded velocity is

        qdot = (r(t + dt) - r(t))/dt + gain (r(t) - q).

    The first term follows the trajectory exactly if the joints obey their commands; the second
    term corrects deviations, within one period if `gain` is None. Use the task to bring a robot to
    the start of a servo task, as a `Phase` of a `Mission`, or beside a servo task in `Parallel`.

    There are three kinds of goal. `to` are coordinates, and `by` are changes of the coordinates
    from the start of each run; both follow a quintic polynomial of the given `duration`, or
    trapezoidal profiles within `speed` and `acceleration`. `trajectory` is any object with
    `duration` and `at(t)`, on the clock of the run.

    Raises
    ------
    InputError
        Unless exactly one of `to`, `by` and `trajectory` is given, with a duration or with limits;
        by `simulate`, for an unknown joint, or for a goal outside the limits of a joint.

    Notes
    -----
    A joint name needs the name of its robot in front ("panda.link3") if several robots have it.
    The features s are the commanded coordinates, and s_goal is the end of the trajectory; with
    `by` both are relative to the start of each run.

    Examples
    --------
    >>> import robsim as rs
    >>> scene = rs.Scene([rs.robots.panda()])
    >>> run = rs.simulate(scene, rs.FollowJoints({"link1": 0.5}, duration=2.0), duration=3.0)
    >>> rs.Outcome(int(run.outcome)).name, float(run.end_time)
    ('CONVERGED', 2.0)
    >>> task = rs.FollowJoints(by={"link1": 0.5}, speed=1.0, acceleration=2.0)
    >>> float(rs.simulate(scene, task, duration=3.0).end_time)
    1.0
    """

    to: Annotated[
        JointValues | None,
        JointGoal(get_followed_axes),
        "Final coordinates of the joints: {joint: value}, or one number for each.",
    ] = None
    _: KW_ONLY
    by: Annotated[
        JointValues | None,
        JointGoal(get_followed_axes),
        "Change of the coordinates from the start, instead of `to`: {joint: change}, or (n,).",
    ] = None
    trajectory: Annotated[
        Trajectory | None,
        TRAJECTORY,
        "Trajectory, instead of `to` and `by`, on the clock of the run.",
    ] = None
    joints: Annotated[
        Joints | None,
        JOINT_NAMES,
        "Names of joints or robots, in the order of the axes of the trajectory; None: the "
        "joints of `to` or `by`, or all joints of one coordinate and one velocity.",
    ] = None
    duration: Annotated[
        float | None,
        Time(above=0),
        "Duration of the motion to `to` or by `by`, along a quintic polynomial.",
    ] = None
    speed: AxisSpeed = None
    acceleration: AxisAcceleration = None
    gain: Annotated[
        float | None,
        PER_SECOND,
        "Gain of the correction of deviations; None: correction within one period.",
    ] = None
    tolerance: Annotated[
        float,
        Number(above=0),
        "Largest distance of a joint from the end of the trajectory at convergence, in rad or m.",
    ] = 1e-6

    def __post_init__(self) -> None:
        names = [name for name in GOAL_FIELDS if getattr(self, name) is not None]
        if len(names) != 1:
            raise InputError(
                "give one of to={joint: value} (or an array), by={joint: change} (or an array), "
                f"or trajectory; got {' and '.join(names) or None}"
            )
        super().__post_init__()
        if self.trajectory is None:
            object.__setattr__(self, names[0], self._check_goal(names[0]))
        self._check_plan()

    rivals: ClassVar[Any] = ((("to",), ("by",), ("trajectory",)),)
    facts_from: ClassVar[Any] = ("joints",)

    @classmethod
    def facts(cls, own: Mapping[str, Any], c: Context) -> Context:  # Any: values of all fields
        """Return the context with the joints of the task, which set the units of its numbers."""
        scene = c.facts.get("scene")
        if sum(name in c.facts["raw"] for name in GOAL_FIELDS) > 1:
            raise UnreadableValue  # reported already
        if scene is None:
            return c
        goals = {key: c.facts["raw"].get(key, own.get(key)) for key in ("to", "by")}
        named = next((key for key, x in goals.items() if isinstance(x, Mapping)), None)
        try:
            if named is not None:
                axes = find_joints(scene, goals[named], named)
            else:
                axes = select_joints(scene, own.get("joints"))
        except InputError as error:
            c.blame(error)
            return c
        return c.with_facts(followed=_describe_axes(scene, axes))

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the velocities of the joints."""
        return make_read_only(np.array(sorted(axis.velocity for axis in self.axes(scene))))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> JointFollower:
        """Return the controller of the task; raise InputError if the scene lacks a joint."""
        axes = self.axes(scene)
        names = [scene.velocity_names[axis.velocity] for axis in axes]
        goal = self._resolve_goal(names)
        coordinates = np.array([axis.coordinate for axis in axes])
        if self.by is None:
            check_joint_goals(scene, coordinates, goal[None])
        order = np.argsort([axis.velocity for axis in axes])
        robot = scene.robots[_find_owner_index(scene, axes[0].velocity)]
        tip = f"{robot.name}.{robot.tip}"
        return JointFollower(
            **make_cameraless_fields(scene, tip, self.columns(scene), goal[order], self),
            units=tuple(scene.coordinate_units[i] for i in coordinates[order]),
            full_rank=len(axes),
            rcond=RCOND,
            goal=goal,
            coordinates=coordinates,
            order=order,
        )

    @property
    def relative(self) -> bool:
        """Whether the goal is relative to the start of each run."""
        return self.by is not None

    @property
    def limits(self) -> Limits | None:
        """Limits of the axes, or None if a duration or a trajectory is given."""
        return None if self.speed is None else Limits(self.speed, self.acceleration)

    def axes(self, scene: Scene) -> list[JointIndices]:
        """Return the joints in the order of the trajectory.

        Parameters
        ----------
        scene : Scene
            Scene with the robots.

        Returns
        -------
        list of JointIndices
            Indices of the velocity and the coordinate of each joint.

        Raises
        ------
        InputError
            If a joint is unknown, ambiguous, prescribed or named twice.
        """
        what, value = self._goal_field
        if isinstance(value, dict):
            return find_joints(scene, value, what)
        return select_joints(scene, self.joints)

    @property
    def _goal_field(self) -> tuple[str, Any]:
        """Name of the field that gives the goal, and its value."""
        fields = ((name, getattr(self, name)) for name in GOAL_FIELDS)
        return next((name, value) for name, value in fields if value is not None)

    def _resolve_goal(self, names: list[str]) -> Array:
        """Return the end of the trajectory (n,); with `by` its length.

        Raises InputError unless the goal has n axes.
        """
        what, value = self._goal_field
        if isinstance(value, dict):
            goal = np.array(list(value.values()))
        elif what != "trajectory":
            goal = value
        else:
            goal = as_floats(value.at(value.duration), "trajectory.at", ("n",))
        if goal.shape != (len(names),):
            raise InputError(
                f"{what}: expected {len(names)} axes, for {', '.join(names)}; got shape "
                f"{goal.shape}: name its joints in that order with joints=[...]"
            )
        if self.trajectory is not None:
            _ = as_floats(self.trajectory.at(0.0), f"{what} at 0 s", goal.shape)
        if self.limits is not None:
            _ = self.limits.of(len(goal))
        return goal

    def _check_goal(self, what: str) -> Any:
        """Return the goal as {name: value}, or as an array (n,)."""
        raw = getattr(self, what)
        if not isinstance(raw, Mapping):
            goal = as_floats(raw, what, ("n",))
            if goal.ndim != 1:
                raise InputError(
                    f"{what}: expected {{joint: value}} or shape (n,), got {goal.shape}"
                )
            return make_read_only(goal)
        if not raw or not all(isinstance(name, str) for name in raw):
            raise InputError(f"{what}: expected the names of joints, got {format_value(raw)}")
        if self.joints is not None:
            raise InputError(f"{what} names its joints: leave joints out")
        goals = {name: as_float(value, f"{what}[{name!r}]") for name, value in raw.items()}
        return ReadOnlyDict(goals)

    def _check_plan(self) -> None:
        """Raise InputError unless exactly one of a trajectory, a duration and limits is given."""
        limits = [name for name in ("speed", "acceleration") if getattr(self, name) is not None]
        if self.trajectory is not None:
            if limits or self.duration is not None:
                raise InputError("a trajectory has its own times: leave duration and limits out")
            check_trajectory(self.trajectory, "trajectory")
        elif (self.duration is None) == (not limits) or len(limits) == 1:
            names = " and ".join([*limits, *(["duration"] if self.duration is not None else [])])
            raise InputError(
                f"give either duration, or speed and acceleration; got {names or None}"
            )


def _find_owner_index(scene: Scene, velocity: int) -> int:
    """Return the index of the robot that has a velocity."""
    ends = np.cumsum([robot.nv for robot in scene.robots])
    return int(np.searchsorted(ends, velocity, "right"))
