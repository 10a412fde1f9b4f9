"""A task that follows a path of a frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, replace
from typing import Annotated, Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.declare import ListOf, Number, Table, Word, fields_of, register
from robsim.declare.context import Context, Raw
from robsim.declare.exact_quantity import ExactQuantity
from robsim.declare.spec import Spec
from robsim.declare.texts import FrameReference
from robsim.geometry.pose import Pose, PoseLike, check_single_pose, is_pose_like
from robsim.geometry.pose_table import PoseSpec
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import INVERSE, Inverse, InverseKind
from robsim.servo.servo_controller import get_rcond
from robsim.servo.shaping.command_fields import RedundancyFields, VelocityIndices
from robsim.servo.tasks.path_follower import PathFollower, estimate_generic_rank
from robsim.servo.tasks.trajectory_follower import (
    Trajectory,
    check_trajectory,
    make_cameraless_fields,
)
from robsim.trajectory import Path, Straight
from robsim.trajectory.pace import (
    Duration,
    OriginAcceleration,
    OriginSpeed,
    Pace,
    TurnAcceleration,
    TurnRate,
)
from robsim.world.scene import Scene

MASK_ROWS = {"pose": 6, "position": 3}  # controlled rows of the twist


@dataclass(frozen=True)
class PathGoal(PoseSpec):
    """Goal of a path: a pose; in Python also a position."""

    python_phrase: ClassVar[str] = "a Pose, or a position (3,)"

    def check(self, value: Any, what: str) -> Any:
        return value  # the task checks it against its mask

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        to = value if isinstance(value, Pose) else Pose.at(*value)
        return {"position": ExactQuantity(to.position, "m"), **self.build_table(to, c)}

    def read(self, raw: Raw, c: Context) -> Pose:
        pose: Pose = super().read(raw, c)
        if c.facts.get("mask") == "position" and "position" not in raw:
            raise InputError("expected position, since the mask is 'position'")
        return pose


@dataclass(frozen=True)
class PathSpec(Spec):
    """A path in a text: a straight segment, or a list of consecutive segments."""

    forms: ClassVar[tuple[str, ...]] = ("table", "list")
    phrase: ClassVar[str] = "a table with start and end, or a list of these"
    python_phrase: ClassVar[str] = "a Straight or a Path"

    def read(self, raw: Raw, c: Context) -> Straight | Path:
        if isinstance(raw, list):
            return Path(ListOf(Table(Straight), 1).read(raw, c))
        segment: Straight = Table(Straight).read(raw, c)
        return segment

    def write(self, value: Any, c: Context) -> Raw:
        if type(value) is Path:
            return ListOf(Table(Straight)).write(value.parts, c)
        return Table(Straight).write(value, c)

    def schema(self, define: Any) -> dict[str, Any]:
        one = define(Straight)
        return {"anyOf": [one, {"type": "array", "items": one}]}


PATH_SPEC = PathSpec()
PATH_INVERSES = replace(INVERSE, only=("pseudo_inverse", "damped"))
PACE_FIELDS = tuple(each.name for each in fields_of(Pace))


@register("task", "follow_path")
@dataclass(frozen=True, eq=False)
class FollowPath(RedundancyFields):
    """Task that drives a frame along a path in the world, without a camera.

    The commanded velocities are

        qdot = J^+ V

    with the Jacobian J of the frame (resolved motion rate control: Whitney 1969; Siciliano et al.
    2009, section 3.7). The twist V = (v, omega) carries the frame from its measured pose to the
    pose of the path one period later. If a `Motion` of the scene moves the frame, its twist is
    subtracted from V. Each period is one step of Newton's method, so the distance from the path is
    of second order in the period.

    With `to` the frame moves on a straight line to a pose, or with mask "position" to a position,
    in the given `duration`, or within `speed` and `acceleration` (and for a pose `turn` and
    `turn_acceleration`). With `path` it follows any object with `duration` and `at(t)`. A
    redundant robot leaves motions free for `secondary`; near a singularity use inverse="damped",
    which leaves the path instead of moving fast.

    Raises
    ------
    InputError
        Unless exactly one of `to` and `path` is given, with a duration or with limits; by
        `simulate`, if no joint moves the frame.

    Notes
    -----
    Toward a pose out of reach the rates grow until a joint reaches its limit or J loses rank; test
    the pose with `Robot.ik` before. The features s are the position and the rotation vector of the
    frame relative to the end of the path, both in world axes.

    Examples
    --------
    >>> import robsim as rs
    >>> scene = rs.Scene([rs.robots.ur5e()])
    >>> task = rs.FollowPath([0.4, -0.2, 0.5], mask="position", duration=2.0)
    >>> run = rs.simulate(scene, task, duration=3.0)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.path_length), 3)
    ('CONVERGED', 0.305)
    """

    to: Annotated[
        PoseLike | None,
        PathGoal(),
        "Goal of a straight path in the world: a pose, or with mask 'position' a position (3,) "
        "in metres.",
    ] = None
    _: KW_ONLY
    path: Annotated[
        Trajectory | None,
        PATH_SPEC,
        "Path instead of `to`: Straight, Path, or an object with duration and at(t) (4, 4).",
    ] = None
    frame: Annotated[
        str | None,
        FrameReference,
        "Name of the moved frame, such as 'panda.tool'; None: the tip of the only robot.",
    ] = None
    mask: Annotated[
        str,
        Word(tuple(MASK_ROWS), "mask"),
        "Controlled part of the motion: the pose of the frame, or the position of its origin.",
    ] = "pose"
    duration: Duration = None
    speed: OriginSpeed = None
    acceleration: OriginAcceleration = None
    turn: TurnRate = None
    turn_acceleration: TurnAcceleration = None
    inverse: Annotated[Inverse, PATH_INVERSES, "Inverse of the Jacobian J of the frame."] = (
        "pseudo_inverse"
    )
    gain: Annotated[
        float | None,
        PER_SECOND,
        "Gain of the correction of deviations; None: correction within one period.",
    ] = None
    tolerance: Annotated[
        float, Number(above=0), "Largest error of each component of s at convergence, in m or rad."
    ] = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.to is None) == (self.path is None):
            raise InputError("give either to=a pose (or a position), or a path")
        if self.to is not None:
            object.__setattr__(self, "to", self._check_goal())
        self._check_plan()

    facts_from: ClassVar[Any] = ("mask",)

    @classmethod
    def facts(cls, own: Mapping[str, Any], c: Context) -> Context:  # Any: values of all fields
        """Return the context with the mask, which determines the keys of `to`."""
        return c.with_facts(mask=own.get("mask"))

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the commanded velocities that move the frame."""
        frame = self._find_frame(scene)
        columns = np.flatnonzero((scene.tree.flag_velocities(frame) != 0) & ~scene.prescribed)
        if not columns.size:
            raise InputError(f"no joint that a task can command moves '{frame}'")
        return self.select_velocities(scene, make_read_only(columns))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> PathFollower:
        """Return the controller of the task; raise InputError if the scene lacks the frame."""
        columns, frame, k = self.columns(scene), self._find_frame(scene), MASK_ROWS[self.mask]
        end = self._find_end_pose()
        s_goal = np.concatenate([end[:3, 3], np.zeros(3)])[:k]
        return PathFollower(
            **make_cameraless_fields(scene, frame, columns, s_goal, self),
            units=("m", "m", "m", "rad", "rad", "rad")[:k],
            full_rank=estimate_generic_rank(scene, frame, columns, k),
            rcond=get_rcond(cast(InverseKind, self.inverse)),
            line_pace=None if self.path is not None else Pace(**self._pace_values()),
            end=end,
            shaping=self.shaping(scene, columns),
        )

    def _pace_values(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in PACE_FIELDS}

    def _find_frame(self, scene: Scene) -> str:
        """Return the name of the frame; raise InputError if the scene has no such frame."""
        if self.frame is not None:
            scene.tree.find(self.frame)
            return self.frame
        tips = [f"{robot.name}.{robot.tip}" for robot in scene.robots]
        if len(tips) != 1:
            raise InputError(f"frame: give the frame to move; tips: {', '.join(tips) or 'none'}")
        return tips[0]

    def _find_end_pose(self) -> Array:
        """Return the pose (3, 4) at the end of the path."""
        if self.path is not None:
            _ = check_single_pose(self.path.at(0.0), "path.at")
            return check_single_pose(self.path.at(self.path.duration), "path.at").matrix[:3]
        if isinstance(self.to, Pose):
            return self.to.matrix[:3]
        return Pose.at(*cast(Array, self.to)).matrix[:3]

    def _check_goal(self) -> Any:
        """Return the goal as a pose or a position; raise InputError for any other value."""
        if is_pose_like(self.to):
            pose = Pose(
                check_single_pose(self.to, "to").matrix
            )  # in the world; frame names are dropped
            return pose if self.mask == "pose" else pose.position
        position = as_floats(cast(ArrayLike, self.to), "to (a pose, or a position)", (3,))
        if position.ndim != 1:
            raise InputError(f"to: expected one position (3,), got {position.shape}")
        if self.mask == "pose":
            raise InputError('to: expected a pose; a position alone is for mask="position"')
        return make_read_only(position)

    def _check_plan(self) -> None:
        """Raise InputError unless exactly one of a path, a duration and all limits is given."""
        values = {name: value for name, value in self._pace_values().items() if value is not None}
        if self.path is not None:
            if values:
                raise InputError("a path has its own times: leave duration and limits out")
            check_trajectory(self.path, "path")
            return
        pace = Pace(**values)
        for name in values:
            object.__setattr__(self, name, getattr(pace, name))
        turns = self.mask == "pose"
        if pace.duration is None and (pace.speed is None or turns == (pace.turn is None)):
            also = ", turn and turn_acceleration" if turns else " alone"
            raise InputError(f"limits: expected speed, acceleration{also}; got {', '.join(values)}")
