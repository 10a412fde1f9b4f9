"""The options of every task about its command: which joints, and what is done after the law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import frozen, positive
from robsim.base.errors import InputError, suggest
from robsim.base.values import Value
from robsim.servo.shaping.limit import SpeedLimit
from robsim.servo.shaping.redundancy import Secondary
from robsim.servo.shaping.shaping import Shaping, as_projection, coordinates_of
from robsim.world.scene import Scene

Columns = NDArray[np.int64]  # indices of velocities of a scene


@dataclass(frozen=True, eq=False)
class Shaped(Value):
    """What can be done to a command after the law.

    joints        names of robots or velocities that are commanded; None: all that matter
    secondary     a motion within what the task leaves free: `AvoidLimits()`, `Posture(q)`, or any
                  object with velocity(q, limits)
    projection    of the secondary motion: "classic", "large" or `LargeProjection(low, high)`
    smooth_start  per second: the command grows from zero, with exp(-smooth_start t)
    limit         `SpeedLimit(...)`
    """

    _: KW_ONLY
    joints: Any = None
    secondary: Any = None
    projection: Any = "classic"
    smooth_start: float | None = None
    limit: SpeedLimit | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "joints", names_of(self.joints))
        is_type = isinstance(self.secondary, type)
        if self.secondary is not None and (is_type or not isinstance(self.secondary, Secondary)):
            raise InputError(
                f"secondary: expected AvoidLimits(), Posture(q) or an object with "
                f"velocity(q, limits), got {self.secondary!r:.80}"
            )
        as_projection(self.projection)
        if self.smooth_start is not None:
            put(self, "smooth_start", positive(self.smooth_start, "smooth_start (per second)"))
        if self.limit is not None and not isinstance(self.limit, SpeedLimit):
            raise InputError(f"limit: expected SpeedLimit(...), got {self.limit!r:.80}")

    def shaping(self, scene: Scene, columns: Columns) -> Shaping:
        """For the commanded velocities of a scene."""
        names = [scene.velocity_names[i] for i in columns]
        parts: tuple[Any, ...] = (self.limit, self.secondary)
        for part in parts:
            if hasattr(part, "check"):
                part.check(names)
        return Shaping(
            self.secondary,
            as_projection(self.projection),
            self.smooth_start,
            self.limit,
            *coordinates_of(scene, columns),
        )

    def chosen(self, scene: Scene, moving: Columns) -> Columns:
        """Those of the velocities that `joints` names."""
        if self.joints is None:
            return moving
        wanted: set[int] = set()
        for name in self.joints:
            wanted |= set(_velocities(scene, name))
        chosen = np.array([i for i in moving if i in wanted], dtype=np.int64)
        if not chosen.size:
            names = [scene.velocity_names[i] for i in moving]
            raise InputError(
                f"joints: none of {', '.join(self.joints)} moves what the task controls; "
                f"these do: {', '.join(names)}"
            )
        return frozen(chosen)


def names_of(given: Any) -> tuple[str, ...] | None:
    """One name or several; InputError for anything else."""
    if given is None:
        return None
    several = [given] if isinstance(given, str) else given
    names = tuple(several) if isinstance(several, list | tuple) else ()
    if not names or not all(isinstance(name, str) for name in names):
        raise InputError(f"joints: expected names of robots or velocities, got {given!r:.80}")
    return names


def _velocities(scene: Scene, name: str) -> Sequence[int]:
    """Indices of a robot's velocities, or of the velocity of that name."""
    names = scene.velocity_names
    starts = np.cumsum([0, *(robot.nv for robot in scene.robots)])
    for i, robot in enumerate(scene.robots):
        if robot.name == name:
            found: Sequence[int] = range(int(starts[i]), int(starts[i + 1]))
            break
    else:
        if name not in names:
            exists = [*(robot.name for robot in scene.robots), *names]
            raise InputError(
                f"joints: no robot or velocity {name!r}; {suggest(name, exists, 'names')}"
            )
        found = [names.index(name)]
    if scene.prescribed[list(found)].any():
        raise InputError(f"joints: '{name}' moves on its own; a task cannot command it as well")
    return found
