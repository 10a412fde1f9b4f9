"""A task that follows a path of a frame."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.declare import ListOf, Number, Table, Word, fields_of, register
from robsim.declare.quantities import ExactQuantity
from robsim.declare.spec import Context, Raw, Spec
from robsim.declare.texts import FrameReference
from robsim.geometry.pose import Pose, check_single_pose, is_pose_like
from robsim.geometry.pose_table import PoseSpec
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import INVERSE
from robsim.servo.servo_controller import get_rcond
from robsim.servo.shaping.command_fields import RedundancyFields, VelocityIndices
from robsim.servo.tasks.path_follower import PathFollower, estimate_generic_rank
from robsim.servo.tasks.trajectory_follower import check_trajectory, make_cameraless_fields
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

MASK_ROWS = {"pose": 6, "position": 3}  # of the twist that is controlled


@dataclass(frozen=True)
class PathGoal(PoseSpec):
    """The goal of a path: a pose, in Python also a position."""

    python_phrase: ClassVar[str] = "a Pose, or a position (3,)"

    def check(self, value: Any, what: str) -> Any:
        return value  # as far as the mask goes, which the task checks

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        to = value if isinstance(value, Pose) else Pose.at(*value)
        return {"position": ExactQuantity(to.position, "m"), **self.written(to, c)}

    def read(self, raw: Raw, c: Context) -> Pose:
        made: Pose = super().read(raw, c)
        if c.facts.get("mask") == "position" and "position" not in raw:
            raise InputError("expected position, which the mask is for")
        return made


@dataclass(frozen=True)
class PathSpec(Spec):
    """A path in a text: a straight segment, or a list of segments one after the other."""

    forms: ClassVar[tuple[str, ...]] = ("table", "list")
    phrase: ClassVar[str] = "a table with start and end, or a list of these"
    python_phrase: ClassVar[str] = "a Straight or a Path"

    def read(self, raw: Raw, c: Context) -> Straight | Path:
        if isinstance(raw, list):
            return Path(ListOf(Table(Straight), 1).read(raw, c))
        way: Straight = Table(Straight).read(raw, c)
        return way

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
    """Drive a frame along a path in the world by resolved rates, without a camera.

    It goes to a pose as `Straight`, with `duration`, or with `speed` and `acceleration`, and
    but for a position `turn` and `turn_acceleration`.

    Resolved motion rate control (Whitney 1969; Siciliano et al. 2009, section 3.7): qdot = J^+ V
    with the twist V = (v, omega) that carries the frame, as it is, to where it should be one period
    later, less what a `Motion` does to it. That is one step of Newton's method in each period, so
    the distance from the path is of the second order in the period. Toward a pose out of reach
    the rates grow, until a joint is at its limit or J loses rank: ask `Robot.ik` before. s is the
    position and the rotation vector from the end of the path, both in world axes.

    >>> FollowPath([0.4, 0.0, 0.3], mask="position", duration=2.0).to
    array([0.4, 0. , 0.3])
    """

    to: Annotated[
        Any,
        PathGoal(),
        "Where the frame goes straight from its start: a pose, or with mask 'position' a "
        "position (3,), in the world.",
    ] = None
    _: KW_ONLY
    path: Annotated[
        Any,
        PATH_SPEC,
        "Path to follow instead of `to`: Straight, Path, or an object with duration and at(t)"
        " (4, 4).",
    ] = None
    frame: Annotated[
        str | None,
        FrameReference,
        "Name of the frame that is moved, such as 'panda.tool'; None: the tip of the only robot.",
    ] = None
    mask: Annotated[
        str,
        Word(tuple(MASK_ROWS), "mask"),
        "What of the frame is controlled: its pose, or the position of its origin.",
    ] = "pose"
    duration: Duration = None
    speed: OriginSpeed = None
    acceleration: OriginAcceleration = None
    turn: TurnRate = None
    turn_acceleration: TurnAcceleration = None
    inverse: Annotated[Any, PATH_INVERSES, "Inverse of the Jacobian J of the frame."] = (
        "pseudo_inverse"
    )
    gain: Annotated[
        float | None,
        PER_SECOND,
        "Gain by which deviations from the path are corrected; None: within one period.",
    ] = None
    tolerance: Annotated[
        float, Number(above=0), "Largest error of each number of s at convergence, in m and rad."
    ] = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.to is None) == (self.path is None):
            raise InputError("give either to=a pose (or a position), or a path")
        if self.to is not None:
            object.__setattr__(self, "to", self._checked_goal())
        self._check_plan()

    facts_from: ClassVar[Any] = ("mask",)

    @classmethod
    def facts(cls, own: Any, c: Context) -> Context:
        """Return the context with the mask, which decides what `to` must say."""
        return c.knowing(mask=own.get("mask"))

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the velocities that move the frame, and can be commanded."""
        frame = self._frame(scene)
        found = np.flatnonzero((scene.tree.carries(frame) != 0) & ~scene.prescribed)
        if not found.size:
            raise InputError(f"no joint that a task can command moves '{frame}'")
        return self.chosen(scene, make_read_only(found))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> PathFollower:
        """Return the controller of the task; InputError for what the scene does not have."""
        columns, frame, k = self.columns(scene), self._frame(scene), MASK_ROWS[self.mask]
        end = self._end()
        s_goal = np.concatenate([end[:3, 3], np.zeros(3)])[:k]
        return PathFollower(
            **make_cameraless_fields(scene, frame, columns, s_goal, self),
            units=("m", "m", "m", "rad", "rad", "rad")[:k],
            full_rank=estimate_generic_rank(scene, frame, columns, k),
            rcond=get_rcond(self.inverse),
            way_pace=None if self.path is not None else Pace(**self._limits_given()),
            end=end,
            shaping=self.shaping(scene, columns),
        )

    def _limits_given(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in PACE_FIELDS}

    def _frame(self, scene: Scene) -> str:
        """Return the name of the frame; InputError if there is none of that name."""
        if self.frame is not None:
            scene.tree.find(self.frame)
            return self.frame
        tips = [f"{robot.name}.{robot.tip}" for robot in scene.robots]
        if len(tips) != 1:
            raise InputError(f"frame: which one is to move? Tips: {', '.join(tips) or 'none'}")
        return tips[0]

    def _end(self) -> Array:
        """Return the pose (3, 4) at which the path ends."""
        if self.path is not None:
            _ = check_single_pose(self.path.at(0.0), "path.at")
            return check_single_pose(self.path.at(self.path.duration), "path.at").matrix[:3]
        if isinstance(self.to, Pose):
            return self.to.matrix[:3]
        return Pose.at(*self.to).matrix[:3]

    def _checked_goal(self) -> Any:
        """Return the goal as a pose or a position; InputError if it is neither."""
        if is_pose_like(self.to):
            pose = Pose(
                check_single_pose(self.to, "to").matrix
            )  # in the world, whatever names it has
            return pose if self.mask == "pose" else pose.position
        place = as_floats(self.to, "to (a pose, or a position)", (3,))
        if place.ndim != 1:
            raise InputError(f"to: expected one position (3,), got {place.shape}")
        if self.mask == "pose":
            raise InputError('to: expected a pose; a position alone is for mask="position"')
        return make_read_only(place)

    def _check_plan(self) -> None:
        """Raise InputError unless there is one of a path, a duration, and all limits."""
        given = {name: value for name, value in self._limits_given().items() if value is not None}
        if self.path is not None:
            if given:
                raise InputError("a path has its own times: leave duration and limits out")
            check_trajectory(self.path, "path")
            return
        pace = Pace(**given)
        for name in given:
            object.__setattr__(self, name, getattr(pace, name))
        turns = self.mask == "pose"
        if pace.duration is None and (pace.speed is None or turns == (pace.turn is None)):
            also = ", turn and turn_acceleration" if turns else " alone"
            raise InputError(f"limits: expected speed, acceleration{also}; got {', '.join(given)}")
