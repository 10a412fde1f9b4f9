"""Features that one stage makes of the points and depths of marks, or of groups of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Self

from robsim.base.arrays import Array, make_read_only, view_runs_last
from robsim.base.errors import InputError
from robsim.base.value import replace_unchecked
from robsim.declare import DeclaredValue
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Observation, Tolerance
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.kernels.machine.stages import CompiledStage


@dataclass(frozen=True, eq=False)
class MarkFeature(CompiledFeature, DeclaredValue):
    """The base of features of the image of marks, with so many numbers for each group of them."""

    tolerance: Tolerance = 1e-5
    unit: str = "1"
    stage: ClassVar[CompiledStage]
    each: ClassVar[int]  # numbers for each group
    least_marks: ClassVar[int] = 1  # of a group, such as the two of a line

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        return seen.computed(self.stage, self.count(seen.N), **seen.image)

    def count(self, N: int) -> int:
        """Return how many numbers s has; InputError unless so many marks can stand in groups."""
        size = self.least_marks
        if not N or N % size:
            raise InputError(
                f"{type(self).__name__}: takes marks {size} by {size}, so their number must be a "
                f"multiple of {size}; the target has {N}"
            )
        return N // size * self.each


@dataclass(frozen=True, eq=False)
class AngleFeature(MarkFeature):
    """The base of features with angles, which are within half a turn of those at the goal."""

    goal: Array | None = field(default=None, init=False, repr=False)  # (k, 1) of `towards`

    def towards(self, goal: Observation) -> Self:
        """Return the feature with angles within half a turn, (-pi, pi], of those at the goal."""
        return replace_unchecked(self, goal=make_read_only(view_runs_last(self.measure(goal))))

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        k = self.count(seen.N)
        return seen.computed(self.stage, k, **seen.image, goal=seen.goal(self.goal, k))
