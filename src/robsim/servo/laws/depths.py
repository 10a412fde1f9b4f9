"""The depth of the marks that goes into L: true, at the goal, constant, or filtered."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError
from robsim.declare import Choice, Length, ListOf, Number, OneOf
from robsim.features import Observation
from robsim.kernels import features as kernels
from robsim.servo.laws.depth_filter import DEPTHS, DepthFilter
from robsim.servo.laws.inverse import product
from robsim.servo.measurement import Measurement, recall, remember
from robsim.servo.sight import Key

Depth = Literal["true", "goal"] | float | DepthFilter
DEPTH = Choice(DEPTHS, default="filter", short=False, plain=("true", "goal"), other=Length(above=0))
Scale = float | tuple[float, ...]  # for all marks, or for each


SCALE = OneOf(
    Number(above=0), ListOf(Number(above=0), 1), words="a factor above zero, or one for each mark"
)


@cache  # it is asked for in every step
def _factors(scale: Scale, marks: int) -> Array:
    """Return the scale as one factor for each mark (N, 1)."""
    return frozen(np.full((marks, 1), np.reshape(scale, (-1, 1))))


@dataclass(frozen=True)
class Depths:
    """The depth that a task takes for its marks, and a factor that makes it wrong on purpose."""

    which: Depth
    scale: Scale

    @property
    def filtered(self) -> bool:
        """Whether the depth is estimated on line by a filter."""
        return isinstance(self.which, DepthFilter)

    @property
    def measured(self) -> bool:
        """Whether the depth follows the marks, so that it can serve as a feature."""
        return self.which == "true" or self.filtered

    def check(self, marks: int, target: str) -> None:
        """Raise InputError unless there is one factor for all marks, or one for each."""
        if isinstance(self.scale, tuple) and len(self.scale) != marks:
            raise InputError(
                f"depth_scale: {len(self.scale)} factors for the {marks} marks of '{target}'"
            )

    def numbers(self, marks: int) -> tuple[int, float, Array]:
        """Return (which, metres, scale (N, 1)) for the kernels."""
        scale = _factors(self.scale, marks)
        if isinstance(self.which, float):
            return kernels.CONSTANT, self.which, scale
        return (kernels.GOAL if self.which == "goal" else kernels.TRUE), 0.0, scale

    def of(self, seen: Observation, measurement: Measurement, key: Key, Z_goal: Array) -> Array:
        """Return the depths (N, B) of the marks that a camera sees now."""
        if isinstance(self.which, DepthFilter):
            Z = self._filtered(self.which, seen, measurement, f"{key[0]} {key[1]}")
            return _factors(self.scale, len(Z)) * Z
        return self._chosen(measurement.projections[key].depth, Z_goal)

    def at_goal(self, Z_goal: Array) -> Array:
        """Return the depths (N, 1) of the marks at the goal."""
        return self._chosen(Z_goal, Z_goal)

    def _chosen(self, Z: Array, Z_goal: Array) -> Array:
        depth = np.empty(Z.shape)
        kernels.choose_depth(*self.numbers(len(Z)), Z_goal, Z, depth)
        return depth

    def _filtered(
        self, filter: DepthFilter, seen: Observation, measurement: Measurement, name: str
    ) -> Array:
        """Return filtered depths (N, B), from how marks moved while the last command was held."""
        names = f"marks {name}", f"covariance {name}"
        if names[0] not in measurement.memory:
            state, P = filter.begin(seen.points_last, seen.K)
        else:
            state, P = (recall(measurement.memory, each) for each in names)
            V = recall(measurement.memory, f"twist {name}")
            state, P = filter.step(state, P, V, measurement.dt, seen.points_last, seen.K)
        for each, array in zip(names, (state, P), strict=True):
            remember(measurement.memory, each, array)
        return filter.depth(state)

    def note(
        self, measurement: Measurement, key: Key, J: Array, qd: Array, own: Array | None
    ) -> None:
        """Remember the twist of a camera relative to its target for the filter.

        It is J qd as commanded plus `own` (6, 1, B), the known part of what moves on its own.
        """
        twist = product(J, np.ascontiguousarray(qd[:, None]))
        twist = twist if own is None else twist + own
        remember(measurement.memory, f"twist {key[0]} {key[1]}", twist[:, 0])
