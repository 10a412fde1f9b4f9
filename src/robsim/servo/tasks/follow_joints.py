"""A task that follows a trajectory of joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, as_float, as_floats, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, KindOf, Number, Time, register
from robsim.declare.joint_numbers import Axes, PerJoint, get_followed_axes
from robsim.declare.problems import UnreadableValue
from robsim.declare.spec import Context, Raw, make_expected_error
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import RCOND
from robsim.servo.shaping.command_fields import JOINT_NAMES, VelocityIndices
from robsim.servo.tasks.joint_follower import JointFollower, check_joint_goals
from robsim.servo.tasks.joint_names import JointIndices, find_joints, select_joints
from robsim.servo.tasks.trajectory_follower import check_trajectory, make_cameraless_fields
from robsim.trajectory.axis_limits import AxisAcceleration, AxisSpeed, Limits
from robsim.trajectory.time_law import TRAJECTORIES
from robsim.world.scene import Scene


@dataclass(frozen=True)
class JointGoal(PerJoint):
    """The goal of joints: {joint: number}, or a list of one number for each joint."""

    forms: ClassVar[tuple[str, ...]] = ("table", "list")
    python_phrase: ClassVar[str] = "{joint: number}, or an array (n,)"

    def check(self, value: Any, what: str) -> Any:
        return value  # as far as the task itself can tell

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

    def _list_of(self, words: str) -> str:
        return "{ joint = number } with units, or a list of one for each"


GOAL_FIELDS = ("to", "by", "trajectory")  # of saying where to go
TRAJECTORY = KindOf(TRAJECTORIES, short=False, protocol=object)


def _describe_axes(scene: Scene, axes: list[JointIndices]) -> Axes:
    at = [axis.coordinate for axis in axes]
    return Axes([scene.coordinate_units[i] for i in at], [scene.coordinate_names[i] for i in at])


@register("task", "follow_joints")
@dataclass(frozen=True, eq=False)
class FollowJoints(DeclaredValue):
    """Follow a trajectory of the joints, without a camera.

    A name is that of the joint, with its robot's in front ("panda.link3") where several have it.
    s are the commanded coordinates, and s_goal is where the trajectory ends; with `by` both are
    counted from the start of each run. Commanded is (r(t + dt) - r(t))/dt + gain (r(t) - q) for the
    trajectory r.

    >>> FollowJoints({"link1": 0.5}, duration=2.0).to
    {'link1': 0.5}
    >>> FollowJoints(by={"link1": 0.1}, duration=2.0).by  # from wherever it starts
    {'link1': 0.1}
    """

    to: Annotated[
        Any,
        JointGoal(get_followed_axes),
        "Where the joints go from their start: {joint: value}, or one number for each.",
    ] = None
    _: KW_ONLY
    by: Annotated[
        Any,
        JointGoal(get_followed_axes),
        "Change of the joints from their start, instead of `to`: {joint: change}, or (n,).",
    ] = None
    trajectory: Annotated[
        Any, TRAJECTORY, "Trajectory to follow instead of `to` and `by`, on the clock of the run."
    ] = None
    joints: Annotated[
        Any,
        JOINT_NAMES,
        "Names of joints or robots, in the order of the axes of the trajectory; None: the "
        "joints of `to` or `by`, or all that have one coordinate and one velocity.",
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
        "Gain by which deviations from the trajectory are corrected; None: within one period.",
    ] = None
    tolerance: Annotated[
        float,
        Number(above=0),
        "Largest distance of each joint from the end of the trajectory at convergence, in rad"
        " or m.",
    ] = 1e-6

    def __post_init__(self) -> None:
        given = [name for name in GOAL_FIELDS if getattr(self, name) is not None]
        if len(given) != 1:
            raise InputError(
                "give one of to={joint: value} (or an array), by={joint: change} (or an array), "
                f"or trajectory; got {' and '.join(given) or None}"
            )
        super().__post_init__()
        if self.trajectory is None:
            object.__setattr__(self, given[0], self._checked_goal(given[0]))
        self._check_plan()

    rivals: ClassVar[Any] = ((("to",), ("by",), ("trajectory",)),)
    facts_from: ClassVar[Any] = ("joints",)

    @classmethod
    def facts(cls, own: Any, c: Context) -> Context:
        """Return the context with the joints of the task, in whose units the numbers are."""
        scene = c.facts.get("scene")
        if sum(way in c.facts["raw"] for way in GOAL_FIELDS) > 1:
            raise UnreadableValue  # which is reported already
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
        return c.knowing(followed=_describe_axes(scene, axes))

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the velocities of the joints of the task."""
        return make_read_only(np.array(sorted(axis.velocity for axis in self.axes(scene))))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> JointFollower:
        """Return the controller of the task; InputError for what the scene does not have."""
        axes = self.axes(scene)
        names = [scene.velocity_names[axis.velocity] for axis in axes]
        goal = self._goal(names)
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
        """Whether the goal is counted from the start of each run."""
        return self.by is not None

    @property
    def limits(self) -> Limits | None:
        """The limits of the axes; None where a duration or a trajectory is given."""
        return None if self.speed is None else Limits(self.speed, self.acceleration)

    def axes(self, scene: Scene) -> list[JointIndices]:
        """Return the joints in the order of the trajectory; InputError for unknown names."""
        what, way = self._way
        if isinstance(way, dict):
            return find_joints(scene, way, what)
        return select_joints(scene, self.joints)

    @property
    def _way(self) -> tuple[str, Any]:
        """Which of `GOAL_FIELDS` is given, and what it says."""
        return next((name, way) for name in GOAL_FIELDS if (way := getattr(self, name)) is not None)

    def _goal(self, names: list[str]) -> Array:
        """Return where the trajectory ends (n,), or how far; InputError unless it has n axes."""
        what, way = self._way
        if isinstance(way, dict):
            goal = np.array(list(way.values()))
        elif what != "trajectory":
            goal = way
        else:
            goal = as_floats(self.trajectory.at(self.trajectory.duration), "trajectory.at", ("n",))
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

    def _checked_goal(self, what: str) -> Any:
        """Return a goal as {name: value}, or as an array (n,)."""
        way = getattr(self, what)
        if not isinstance(way, Mapping):
            goal = as_floats(way, what, ("n",))
            if goal.ndim != 1:
                raise InputError(
                    f"{what}: expected {{joint: value}} or shape (n,), got {goal.shape}"
                )
            return make_read_only(goal)
        if not way or not all(isinstance(name, str) for name in way):
            raise InputError(f"{what}: expected the names of joints, got {format_value(way)}")
        if self.joints is not None:
            raise InputError(f"{what} names its joints: leave joints out")
        return {name: as_float(value, f"{what}[{name!r}]") for name, value in way.items()}

    def _check_plan(self) -> None:
        """Raise InputError unless there is one of a trajectory, a duration, and limits."""
        limits = [name for name in ("speed", "acceleration") if getattr(self, name) is not None]
        if self.trajectory is not None:
            if limits or self.duration is not None:
                raise InputError("a trajectory has its own times: leave duration and limits out")
            check_trajectory(self.trajectory, "trajectory")
        elif (self.duration is None) == (not limits) or len(limits) == 1:
            given = " and ".join([*limits, *(["duration"] if self.duration is not None else [])])
            raise InputError(
                f"give either duration, or speed and acceleration; got {given or None}"
            )


def _find_owner_index(scene: Scene, velocity: int) -> int:
    """Return the number of the robot that has a velocity."""
    ends = np.cumsum([robot.nv for robot in scene.robots])
    return int(np.searchsorted(ends, velocity, "right"))
