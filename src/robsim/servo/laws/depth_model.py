"""The depth of the marks that goes into L: true, at the goal, constant, or filtered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import KindOf, Length, ListOf, Number, OneOf
from robsim.servo.laws.depth_filter import DEPTHS, DepthFilter

Depth = Literal["true", "goal"] | float | DepthFilter
DEPTH = KindOf(DEPTHS, default="filter", short=False, plain=("true", "goal"), other=Length(above=0))
DepthScale = float | tuple[float, ...]  # for all marks, or for each


DEPTH_SCALE = OneOf(
    Number(above=0), ListOf(Number(above=0), 1), words="a factor above zero, or one for each mark"
)


@dataclass(frozen=True)
class DepthModel:
    """The depth that a task takes for its marks, and a factor that makes it wrong on purpose."""

    which: Depth = "true"
    scale: Any = 1.0  # `DepthScale`, or (1, B) or (N, B) where each run has its own

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

    def factors(self, marks: int) -> Array:
        """Return the factor (N, 1) of each mark, or (N, B) of each in each run."""
        found = np.empty((marks, self.runs))
        found[:] = self.scale if self.runs > 1 else np.reshape(self.scale, (-1, 1))
        return found

    @property
    def runs(self) -> int:
        """The number of runs of which each has factors of its own, or 1."""
        return int(self.scale.shape[1]) if isinstance(self.scale, np.ndarray) else 1

    def at_goal(self, Z_goal: Array) -> Array:
        """Return the depths (N, B) of the marks at the goal, as they go into L."""
        Z = np.full(Z_goal.shape, self.which) if isinstance(self.which, float) else Z_goal
        return self.factors(len(Z)) * Z
