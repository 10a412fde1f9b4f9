"""The depth of the marks in L: true, at the goal, constant, or filtered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import KindOf, Length, ListOf, Number, OneOf
from robsim.servo.laws.depth_filter import DEPTHS, DepthFilter

Depth = Literal["true", "goal"] | float | DepthFilter
DEPTH = KindOf(DEPTHS, default="filter", short=False, plain=("true", "goal"), other=Length(above=0))
Scale = float | Sequence[float]  # one factor for all marks, or one for each mark


DEPTH_SCALE = OneOf(
    Number(above=0), ListOf(Number(above=0), 1), words="a factor above zero, or one for each mark"
)


@dataclass(frozen=True)
class DepthModel:
    """The depth of the marks that a task uses, with a factor to study errors of the depth."""

    which: Depth = "true"
    scale: Scale | Array = 1.0  # as an array (1, B) or (N, B): individual factors for each run

    @property
    def filtered(self) -> bool:
        """Whether a filter estimates the depth on line."""
        return isinstance(self.which, DepthFilter)

    @property
    def follows_marks(self) -> bool:
        """Whether the depth follows the marks, so that it can serve as a feature."""
        return self.which == "true" or self.filtered

    def check(self, marks: int, target: str) -> None:
        """Raise InputError unless there is one factor for all marks, or one for each mark."""
        if isinstance(self.scale, tuple) and len(self.scale) != marks:
            raise InputError(
                f"depth_scale: {len(self.scale)} factors for the {marks} marks of '{target}'"
            )

    def factors(self, marks: int) -> Array:
        """Return the factor (N, 1) of each mark, or (N, B) of each mark in each run."""
        factors = np.empty((marks, self.runs))
        factors[:] = self.scale if self.runs > 1 else np.reshape(self.scale, (-1, 1))
        return factors

    @property
    def runs(self) -> int:
        """Number of runs with individual factors, or 1."""
        return int(self.scale.shape[1]) if isinstance(self.scale, np.ndarray) else 1

    def at_goal(self, Z_goal: Array) -> Array:
        """Return the depths (N, B) of the marks at the goal, as used in L."""
        Z = np.full(Z_goal.shape, self.which) if isinstance(self.which, float) else Z_goal
        return self.factors(len(Z)) * Z
