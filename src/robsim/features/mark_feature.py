"""Bases of the features that one stage computes from the points and depths of marks."""

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
    """Base of features with a fixed number of components for each group of marks."""

    tolerance: Tolerance = 1e-5
    unit: str = "1"
    stage: ClassVar[CompiledStage]
    each: ClassVar[int]  # components of one group
    least_marks: ClassVar[int] = 1  # marks of one group, such as 2 for a line

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program; return their rows."""
        return seen.computed(self.stage, self.count(seen.N), **seen.image)

    def count(self, N: int) -> int:
        """Return the number of components of s for N marks.

        Raises
        ------
        InputError
            If the marks do not divide into groups of `least_marks`.
        """
        size = self.least_marks
        if not N or N % size:
            raise InputError(
                f"{type(self).__name__}: takes marks {size} by {size}, so their number must be a "
                f"multiple of {size}; the target has {N}"
            )
        return N // size * self.each


@dataclass(frozen=True, eq=False)
class AngleFeature(MarkFeature):
    """Base of features with angles; an angle is within half a turn of its value at the goal."""

    goal: Array | None = field(default=None, init=False, repr=False)  # (k, 1), set by `towards`

    def towards(self, goal: Observation) -> Self:
        """Return the feature with angles within half a turn of the goal.

        Parameters
        ----------
        goal : Observation
            Observation of the marks at the goal.

        Returns
        -------
        Lines, Polar or Segments
            The feature with each angle within (-pi, pi] of its value at the goal.

        Raises
        ------
        InputError
            If `goal` is not an Observation, or has too few marks.
        """
        return replace_unchecked(self, goal=make_read_only(view_runs_last(self.measure(goal))))

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program; return their rows."""
        k = self.count(seen.N)
        return seen.computed(self.stage, k, **seen.image, goal=seen.goal(self.goal, k))
