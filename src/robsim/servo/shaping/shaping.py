"""What is done to a command after the law: secondary motion, smooth start, speed limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, numbers, shown_view
from robsim.base.errors import InputError
from robsim.declare import Choice, Declared, Number, family, register
from robsim.servo.laws.inverse import RCOND, product
from robsim.servo.measurement import Measurement, recall, remember
from robsim.servo.shaping.limit import SpeedLimit
from robsim.servo.shaping.redundancy import Secondary, large_projection, null_space
from robsim.world.scene import Scene

PROJECTIONS = family("projection")


@register("projection", "large")
@dataclass(frozen=True)
class LargeProjection(Declared):
    """The large projection: far from the goal a secondary motion need only keep ||e||.

    Above `high` (in units of ||e||) only the norm is kept, below `low` every component, between
    them the two are blended; see `robsim.servo.shaping.redundancy.large_projection`.

    >>> LargeProjection()
    LargeProjection(low=0.01, high=0.1)
    """

    low: Annotated[
        float, Number(above=0), "Norm ||e|| below which every component of e is kept."
    ] = 0.01
    high: Annotated[float, Number(above=0), "Norm ||e|| above which only the norm is kept."] = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low >= self.high:
            raise InputError(f"low must be below high, got {self.low} and {self.high}")


PROJECTION = Choice(PROJECTIONS, default="large", plain=("classic",))


@dataclass(frozen=True, eq=False)
class Shaping:
    """What is done to the command after the law, for the commanded velocities of a scene."""

    secondary: Secondary | None
    projection: LargeProjection | None
    smooth_start: float | None  # per second
    limit: SpeedLimit | None
    coordinates: NDArray[np.int64]  # of each commanded velocity; -1 if it has none of its own
    limits: Array  # (n, 2) of these coordinates, in rad or m

    @property
    def idle(self) -> bool:
        """Whether every command is left as it is."""
        return self.secondary is None and self.smooth_start is None and self.limit is None

    def shaped(
        self, measurement: Measurement, qd: Array, task_jacobian: Array, error: Array, J: Array
    ) -> Array:
        """Return the shaped command (n, B) from that of the law."""
        if self.secondary is not None:
            wish = self._wish(measurement.q, qd.shape)
            P = null_space(task_jacobian, RCOND)
            if self.projection:
                low, high = self.projection.low, self.projection.high
                P = large_projection(task_jacobian, error, low, high, P)
            qd = qd + product(P, wish[:, None])[:, 0]
        if self.smooth_start is not None:
            qd = self._smooth(measurement, qd)
        return qd if self.limit is None else self.limit.scaled(qd, J)

    def _wish(self, q: Array, wanted: tuple[int, ...]) -> Array:
        """Return the secondary motion (n, B), which may come from a user's class."""
        assert self.secondary is not None
        name, first = type(self.secondary).__name__, wanted[::-1]
        given = self.secondary.velocity(shown_view(self._q(q)), self.limits)
        wish = numbers(given, f"{name}.velocity", first)
        if wish.shape != first:
            raise InputError(f"{name}.velocity: expected shape {first}, got {wish.shape}")
        return np.ascontiguousarray(wish.T)

    def _smooth(self, measurement: Measurement, qd: Array) -> Array:
        """Return qd - exp(-mu t) qd(0), continuous from zero (Mansard and Chaumette 2007)."""
        assert self.smooth_start is not None
        if "first" not in measurement.memory:
            remember(measurement.memory, "first", qd)
        late: Array = qd - np.exp(-self.smooth_start * measurement.time) * recall(
            measurement.memory, "first"
        )
        return late

    def _q(self, q: Array) -> Array:
        """Return coordinates (n, B), zero for velocities without a coordinate of their own."""
        return np.where(self.coordinates[:, None] >= 0, q[self.coordinates], 0.0)


def coordinates_of(scene: Scene, columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """Return the coordinate that each velocity alone changes (else -1), and its limits (n, 2)."""
    found = scene.tree.alone(columns)
    limits = np.where((found >= 0)[:, None], scene.limits[found], [-np.inf, np.inf])
    return found, frozen(limits)
