"""The fields of tasks about their command: the commanded joints, and the shaping."""

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
from robsim.servo.shaping.command_shaper import PROJECTION, CommandShaper, find_coordinates
from robsim.servo.shaping.redundancy import SECONDARY
from robsim.servo.shaping.speed_limit import SPEED_LIMIT, SpeedLimit
from robsim.world.scene import Scene

JOINT_NAMES = Names()
VelocityIndices = NDArray[np.int64]  # indices of velocities of a scene


@dataclass(frozen=True, eq=False)
class CommandFields(DeclaredValue):
    """The fields of a task about its command: the joints, and what is done after the law."""

    group: ClassVar[str] = "shaping"
    _: KW_ONLY
    joints: Annotated[
        Any,
        JOINT_NAMES,
        "Names of the robots or velocities that are commanded; None: all that move what the "
        "task controls.",
    ] = None
    smooth_start: Annotated[
        float | None,
        PER_SECOND,
        PerRun(()),
        "Rate mu at which the command grows from zero: exp(-mu t) of the first command is "
        "taken off; None: it starts at once.",
    ] = None
    limit: Annotated[
        SpeedLimit | None, SPEED_LIMIT, "Speed limits, under which the command keeps its direction."
    ] = None

    # of a task that leaves no motions free
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

    def chosen(self, scene: Scene, moving: VelocityIndices) -> VelocityIndices:
        """Return those of the velocities `moving` that `joints` names."""
        if self.joints is None:
            return moving
        wanted: set[int] = set()
        for name in self.joints:
            wanted |= set(_find_velocities(scene, name))
        chosen = np.array([i for i in moving if i in wanted], dtype=np.int64)
        if not chosen.size:
            names = [scene.velocity_names[i] for i in moving]
            raise InputError(
                f"joints: none of {', '.join(self.joints)} moves what the task controls; "
                f"these do: {', '.join(names)}"
            )
        return make_read_only(chosen)


@dataclass(frozen=True, eq=False)
class RedundancyFields(CommandFields):
    """The fields of a task that may leave motions free, about what is done with these."""

    group: ClassVar[str] = "shaping"
    _: KW_ONLY
    secondary: Annotated[
        Any,
        SECONDARY,
        "Motion within what the task leaves free: a kind, or an object with velocity(q, limits).",
    ] = None
    projection: Annotated[Any, PROJECTION, "Projector of the secondary motion."] = "classic"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.secondary is None and self.projection != "classic":
            raise InputError(
                "projection is that of a secondary motion, and none is given: give secondary, or "
                "leave projection out"
            )


def _find_velocities(scene: Scene, name: str) -> Sequence[int]:
    """Return the indices of a robot's velocities, or of the velocity of that name."""
    ends = pairwise(accumulate((robot.nv for robot in scene.robots), initial=0))
    robots = {robot.name: range(*both) for robot, both in zip(scene.robots, ends, strict=True)}
    velocities = {other: [i] for i, other in enumerate(scene.velocity_names)}
    exists: dict[str, Sequence[int]] = {**robots, **velocities, **robots}
    if name not in exists:
        raise InputError(
            f"joints: no robot or velocity {name!r}; {suggest_names(name, exists, 'names')}"
        )
    found = exists[name]
    if scene.prescribed[list(found)].any():
        raise InputError(f"joints: '{name}' moves on its own; a task cannot command it as well")
    return found
