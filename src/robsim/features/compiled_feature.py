"""Built-in features: stages of a compiled program that Python can evaluate as well."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from robsim.base.arrays import Array, view_runs_first
from robsim.base.errors import InputError, format_value
from robsim.features.feature import Observation, repeat_marks
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages


class CompiledFeature(ABC):
    """Base of features with s and L computed by the stages of a compiled program."""

    @classmethod
    def is_own(cls) -> bool:
        """Return whether the class overrides `measure` or `interaction` in Python."""
        return (
            cls.measure is not CompiledFeature.measure
            or cls.interaction is not CompiledFeature.interaction
        )

    @abstractmethod
    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program; return their rows."""

    def measure(self, seen: Observation) -> Array:
        """Return the features.

        Parameters
        ----------
        seen : Observation
            Marks of B runs.

        Returns
        -------
        ndarray of shape (B, k)
            Features s. NaN for a component without a value.

        Raises
        ------
        InputError
            If the observation has too few marks, or another number of runs than the goal.
        """
        return view_runs_first(self._evaluate_stages(seen)[0])

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix.

        Parameters
        ----------
        seen : Observation
            Marks of B runs.

        Returns
        -------
        ndarray of shape (B, k, 6)
            Interaction matrix L with sdot = L V_c for the camera twist V_c = (v, omega) in camera
            axes. NaN for a component without a value.

        Raises
        ------
        InputError
            If the observation has too few marks, or another number of runs than the goal.
        """
        return view_runs_first(self._evaluate_stages(seen)[1])

    def _evaluate_stages(self, seen: Observation) -> list[Array]:
        """Return s (k, B) and L (k, 6, B).

        Raises InputError if the observation has too few marks, or if its number of runs differs
        from the number of runs at the goal.
        """
        if not isinstance(seen, Observation):
            raise InputError(
                f"{type(self).__name__}: expected an Observation, got {format_value(seen)}"
            )
        arrays = _collect_observation_arrays(seen, getattr(self, "uses_pose", False))

        def add(program: Program, *rows: BlockRows) -> list[BlockRows]:
            N, none = len(seen.pixels_last), BlockRows(-1)  # no stage reads these rows
            observed: dict[str, Any] = dict(zip(arrays, rows, strict=True))
            if "other" in observed:
                observed["other"] = ObservationRows(
                    program, N, none, observed["other"], none, none, none, none
                )
            result = self.stages(ObservationRows(program, N, **observed, guess=none))
            _check_counts_seen(self, program.runs, seen)
            return [result.s, result.L]

        return evaluate_stages(add, [*arrays.values()], runs=seen.runs)


def _check_counts_seen(feature: CompiledFeature, runs: int, seen: Observation) -> None:
    """Raise InputError if too few marks are observed, or a number of runs unlike the goal's."""
    name, least = type(feature).__name__, getattr(feature, "least_marks", 1)
    N, _, observed = seen.pixels_last.shape
    if least > N:
        raise InputError(f"{name} needs at least {least} marks, got {N}")
    if runs > 1 and seen.runs is None and runs != observed:
        raise InputError(f"{name}: the goal has {runs} runs, the observation {observed}")


def _collect_observation_arrays(seen: Observation, posed: bool) -> dict[str, Array]:
    """Return the observed arrays, run last, by the names of the fields of `ObservationRows`."""
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
