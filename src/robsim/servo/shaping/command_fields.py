"""Fields of tasks for their command: the commanded joints, and changes after the law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from itertools import accumulate, pairwise
from typing import Annotated, Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import make_read_only
from robsim.base.errors import InputError, suggest_names
from robsim.declare import DeclaredValue, PerRun
from robsim.declare.lists import Names
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.shaping.command_shaper import (
    PROJECTION,
    CommandShaper,
    Projector,
    find_coordinates,
)
from robsim.servo.shaping.redundancy import SECONDARY, Subtask
from robsim.servo.shaping.speed_limit import SPEED_LIMIT, SpeedLimit
from robsim.world.scene import Scene

JOINT_NAMES = Names()
Joints = str | Sequence[str]  # names of robots, joints or velocities
VelocityIndices = NDArray[np.int64]  # indices of velocities in a scene


@dataclass(frozen=True, eq=False)
class CommandFields(DeclaredValue):
    """Fields of a task for its command: the joints, a smooth start and speed limits."""

    group: ClassVar[str] = "shaping"
    _: KW_ONLY
    joints: Annotated[
        Joints | None,
        JOINT_NAMES,
        "Names of the commanded robots or velocities; None: all that move the features.",
    ] = None
    smooth_start: Annotated[
        float | None,
        PER_SECOND,
        PerRun(()),
        "Rate mu at which the command grows from zero: exp(-mu t) times the first command is "
        "subtracted; None: full command at once.",
    ] = None
    limit: Annotated[
        SpeedLimit | None,
        SPEED_LIMIT,
        "Speed limits that scale the command and keep its direction.",
    ] = None

    # defaults of tasks that leave no motions free; Any: `RedundancyFields` declares their types
    secondary = cast(Any, None)
    projection = cast(Any, "classic")

    def shaping(self, scene: Scene, columns: VelocityIndices) -> CommandShaper:
        """Return the shaping of the commanded velocities of a scene."""
        names = [scene.velocity_names[i] for i in columns]
        parts: tuple[Any, ...] = (self.limit, self.secondary)
        for part in parts:
            if hasattr(part, "check"):
                part.check(names)
        large = None if isinstance(self.projection, str) else self.projection
        at = find_coordinates(scene, columns)
        return CommandShaper(self.secondary, large, self.smooth_start, self.limit, *at)

    def select_velocities(self, scene: Scene, moving: VelocityIndices) -> VelocityIndices:
        """Return the velocities in `moving` that `joints` names."""
        if self.joints is None:
            return moving
        named_velocities: set[int] = set()
        for name in self.joints:
            named_velocities |= set(_find_velocities(scene, name))
        commanded = np.array([i for i in moving if i in named_velocities], dtype=np.int64)
        if not commanded.size:
            names = [scene.velocity_names[i] for i in moving]
            raise InputError(
                f"joints: none of {', '.join(self.joints)} moves a feature or a frame of the task; "
                f"these do: {', '.join(names)}"
            )
        return make_read_only(commanded)


@dataclass(frozen=True, eq=False)
class RedundancyFields(CommandFields):
    """Fields of a task that may leave motions free: a secondary motion and its projector."""

    group: ClassVar[str] = "shaping"
    _: KW_ONLY
    secondary: Annotated[
        Subtask | None,
        SECONDARY,
        "Motion in the free motions of the task: a kind, or an object with velocity(q, limits).",
    ] = None
    projection: Annotated[Projector, PROJECTION, "Projector of the secondary motion."] = "classic"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.secondary is None and self.projection != "classic":
            raise InputError(
                "projection needs a secondary motion, and none is given: give secondary, or "
                "leave projection out"
            )


def _find_velocities(scene: Scene, name: str) -> Sequence[int]:
    """Return the velocity indices of a robot, or the index of one velocity, by name."""
    ends = pairwise(accumulate((robot.nv for robot in scene.robots), initial=0))
    robots = {robot.name: range(*pair) for robot, pair in zip(scene.robots, ends, strict=True)}
    velocities = {other: [i] for i, other in enumerate(scene.velocity_names)}
    exists: dict[str, Sequence[int]] = {**robots, **velocities, **robots}
    if name not in exists:
        raise InputError(
            f"joints: no robot or velocity {name!r}; {suggest_names(name, exists, 'names')}"
        )
    indices = exists[name]
    if scene.prescribed[list(indices)].any():
        raise InputError(f"joints: '{name}' moves on its own; a task cannot command it as well")
    return indices
