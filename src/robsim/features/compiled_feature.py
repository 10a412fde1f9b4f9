"""Built-in features, which are stages of a program and can be asked in Python as well."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from robsim.base.arrays import Array, view_runs_first
from robsim.base.errors import InputError, format_value
from robsim.features.feature import Observation, repeat_marks
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluated


class CompiledFeature(ABC):
    """The base of features whose s and L are computed by stages of a program."""

    @classmethod
    def is_own(cls) -> bool:
        """Return whether a user's subclass measures in Python instead."""
        return (
            cls.measure is not CompiledFeature.measure
            or cls.interaction is not CompiledFeature.interaction
        )

    @abstractmethod
    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""

    def measure(self, seen: Observation) -> Array:
        """Return the features s (B, k)."""
        return view_runs_first(self._evaluated(seen)[0])

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, k, 6)."""
        return view_runs_first(self._evaluated(seen)[1])

    def _evaluated(self, seen: Observation) -> list[Array]:
        """Return s (k, B) and L (k, 6, B).

        InputError: fewer marks than it needs, or another number of runs than at the goal.
        """
        if not isinstance(seen, Observation):
            raise InputError(
                f"{type(self).__name__}: expected an Observation, got {format_value(seen)}"
            )
        arrays = _collect_observation_arrays(seen, getattr(self, "uses_pose", False))

        def add(program: Program, *rows: BlockRows) -> FeatureRows:
            N, none = len(seen.pixels_last), BlockRows(-1)  # what no stage takes
            shown: dict[str, Any] = dict(zip(arrays, rows, strict=True))
            if "other" in shown:
                shown["other"] = ObservationRows(
                    program, N, none, shown["other"], none, none, none, none
                )
            made = self.stages(ObservationRows(program, N, **shown, guess=none))
            _check_counts_seen(self, program.runs, seen)
            return made

        return evaluated(add, [*arrays.values()], runs=seen.runs)


def _check_counts_seen(feature: Any, runs: int, seen: Observation) -> None:
    """Raise InputError where too few marks are seen, or other runs than a goal has numbers of."""
    name, least = type(feature).__name__, getattr(feature, "least_marks", 1)
    N, _, there = seen.pixels_last.shape
    if least > N:
        raise InputError(f"{name} needs at least {least} marks; {N} are seen")
    if runs > 1 and seen.runs is None and runs != there:
        raise InputError(f"{name}: the goal is of {runs} runs, and {there} are seen")


def _collect_observation_arrays(seen: Observation, posed: bool) -> dict[str, Array]:
    """Return what is seen, with the run last, under the names of the fields of `ObservationRows`."""
    runs = seen.pixels_last.shape[-1]
    model = np.zeros((len(seen.pixels_last), 3)) if seen.model is None else seen.model
    arrays = {
        "pixels": seen.pixels_last,
        "points": seen.points_last,
        "depth": seen.depth_last,
        "camera": np.repeat(seen.camera.rows, runs // seen.camera.rows.shape[1], axis=1),
        "model": repeat_marks(model, runs),
    }
    if posed:
        arrays["fitted"] = seen.pose_last
    if seen.other is not None and seen.between_last is not None:
        arrays |= {"other": seen.other.points_last, "between": seen.between_last}
    return arrays
