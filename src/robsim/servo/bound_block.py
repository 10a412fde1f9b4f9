"""A feature block bound to a scene, which measures its feature and checks the shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_positive, view_runs_last
from robsim.base.errors import InputError, format_value
from robsim.base.protocols import implements
from robsim.base.value import replace_unchecked
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Feature, Observation, reads_pictures
from robsim.features.feature_rows import FeatureRows, ObservationRows, select_rows
from robsim.features.images.taken_pictures import find_pictures, put_results, select_pictures
from robsim.features.numeric_interaction import compute_interaction
from robsim.kernels.formulas.projection_arrays import Projection
from robsim.kernels.machine.program import Blocks
from robsim.servo.camera_target import CameraTarget, PairKey, compute_relative_pose
from robsim.servo.user_return import check_returned_array


@dataclass(frozen=True, eq=False)
class BoundBlock:
    """A feature block bound to a scene: its feature, measured by one camera or a stereo pair."""

    feature: Feature
    sights: tuple[CameraTarget, ...]  # believed
    marks: NDArray[np.int64] | None
    components: NDArray[np.int64] | None
    weight: float
    k: int | None = None  # number of components of the feature; None before a measurement

    @property
    def name(self) -> str:
        """Name of the feature's class."""
        return type(self.feature).__name__

    @property
    def uses_pictures(self) -> bool:
        """Whether the feature is measured from whole pictures instead of marks."""
        return reads_pictures(self.feature)

    @property
    def largest_step(self) -> float | None:
        """Largest remaining step of the camera at convergence, in m and rad; None: any."""
        step = getattr(self.feature, "step", None) if self.uses_pictures else None
        return as_positive(step, f"{self.name}.step") if step else None

    @property
    def models_interaction(self) -> bool:
        """Whether the feature itself follows the choice of L."""
        return hasattr(self.feature, "with_interaction")

    def with_interaction(self, which: Any) -> BoundBlock:
        """Return the block whose feature follows a choice of L, if it does."""
        if not self.models_interaction:
            return self
        if not isinstance(which, str):
            raise InputError(
                f"interaction: {self.name} takes 'current', 'desired' or 'mean', got "
                f"{format_value(which)}"
            )
        return replace(self, feature=self.feature.with_interaction(which))  # type: ignore[attr-defined]

    def towards(self, goal: Observation) -> BoundBlock:
        """Return the block measured relative to the goal, if its feature has `towards`."""
        towards = getattr(self.feature, "towards", None)
        if towards is None:
            return self
        feature = towards(goal)
        if not implements(feature, Feature):
            raise InputError(
                f"{self.name}.towards returned {format_value(feature)} instead of a feature"
            )
        return replace(self, feature=feature)

    def with_size(self, goal: Observation) -> BoundBlock:
        """Return the block with the size k of s at the goal, which later checks require."""
        whole = replace(self, components=None)
        return replace(self, k=len(whole.measure(goal)))

    def observation(self, seen: ObservationRows, blocks: Blocks) -> Observation:
        """Return the observation of all marks from blocks, before a selection of marks."""
        cameras = [sight.eye.camera for sight in self.sights]
        return seen.observation(blocks, cameras)

    def at_goal(
        self, seen: dict[PairKey, Observation], projections: dict[PairKey, Projection]
    ) -> Observation:
        """Return the feature's observation at the goal, with cameras at their believed poses."""
        whole = self.all_at_goal(seen, projections)
        return whole if self.marks is None else whole.some(self.marks)

    def all_at_goal(
        self, seen: dict[PairKey, Observation], projections: dict[PairKey, Projection]
    ) -> Observation:
        """Return the observation of all marks at the goal, before a selection of marks."""
        first, *others = (sight.key for sight in self.sights)
        observation = seen[first]
        for second in others:  # at most one
            between = compute_relative_pose(projections[first].T_w_c, projections[second].T_w_c)
            observation = replace_unchecked(observation, other=seen[second], between_last=between)
        return observation

    def stages(self, seen: ObservationRows, with_L: bool = True) -> FeatureRows:
        """Add the stages of s and L to a program; return the rows of the chosen components.

        `with_L` decides whether L of a user's feature is evaluated.
        """
        if self.marks is not None:
            seen = seen.some(self.marks)
        rows = self._add_all_components(seen, with_L)
        if self.components is None:
            return rows
        s, L = (select_rows(seen.program, each, self.components) for each in (rows.s, rows.L))
        return FeatureRows(s, L, rows.status, rows.damping)

    def _add_all_components(self, seen: ObservationRows, with_L: bool) -> FeatureRows:
        """Return the rows of all components; a user's feature is evaluated in Python."""
        compiled = self._compiled_feature
        if compiled is not None:
            return compiled.stages(seen)
        whole = replace(self, components=None)
        if self.uses_pictures:
            return whole.add_image_stages(seen)
        rows = seen.room(self.k or 0)

        def evaluate(blocks: Blocks, step: int) -> None:
            view = whole.observation(seen, blocks)
            blocks.put(rows.s, whole.measure(view))
            if with_L:
                blocks.put(rows.L, whole.interaction(view))

        seen.program.call(evaluate)
        return rows

    def add_image_stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stage of a feature of pictures, which Python evaluates when a picture arrives.

        Between pictures the rows keep their numbers.
        """
        rows = seen.room(self.k or 0)._replace(status=seen.program.rows())
        find_damping = getattr(self.feature, "find_damping", None)
        if find_damping is not None:
            rows = rows._replace(damping=seen.program.rows())

        def evaluate(blocks: Blocks, step: int) -> None:
            taken = find_pictures(blocks, self.sights[0].eye.name)
            if taken is None or not len(taken.runs):
                return
            view = select_pictures(self.observation(seen, blocks), taken, step * seen.seconds)
            put_results(blocks, rows.s, self.measure(view), taken)
            put_results(blocks, rows.L, self.interaction(view), taken)
            if rows.status is not None:
                put_results(blocks, rows.status, self.find_faults(view), taken)
            if rows.damping is not None and find_damping is not None:
                put_results(blocks, rows.damping, find_damping(view), taken)

        seen.program.call(evaluate)
        return rows

    @property
    def _compiled_feature(self) -> CompiledFeature | None:
        """The feature if it consists of stages, or None for a user's feature."""
        feature = self.feature
        return feature if isinstance(feature, CompiledFeature) and not feature.is_own() else None

    @property
    def size(self) -> int:
        """Number of chosen components."""
        return len(self.components) if self.components is not None else self.k or 0

    def measure(self, seen: Observation) -> Array:
        """Return the chosen components s (k, B)."""
        return self._check_returned(self.feature.measure(seen), seen)

    def measure_goal(self, goal: Observation) -> Array:
        """Return the chosen components s_goal (k, R): s at the goal, or zeros."""
        s = self.measure(goal)
        return np.zeros_like(s) if getattr(self.feature, "zero_at_goal", False) else s

    def interaction(self, seen: Observation) -> Array:
        """Return L (k, 6, B) of the chosen components, for the first camera's twist."""
        return self._check_returned(compute_interaction(self.feature, seen), seen, 6)

    def find_faults(self, seen: Observation) -> Array:
        """Return the status (B,) of pictures, as the feature judges them."""
        find = getattr(self.feature, "find_faults", None)
        return (
            np.zeros(seen.pixels_last.shape[-1]) if find is None else np.asarray(find(seen), float)
        )

    def gone(self, blind: Observation) -> NDArray[np.bool_]:
        """Return (k, B): whether each component is NaN in an observation with hidden marks."""
        if self.marks is not None:
            blind = blind.some(self.marks)
        if self.uses_pictures:
            return np.zeros((self.size, blind.pixels_last.shape[-1]), dtype=np.bool_)
        try:
            return np.asarray(np.isnan(self.measure(blind)))
        except np.linalg.LinAlgError:  # a user's feature may call LAPACK, which rejects NaN
            return np.ones((self.size, blind.pixels_last.shape[-1]), dtype=np.bool_)

    def depends(self, seen: Observation) -> NDArray[np.bool_] | None:
        """Return (k, cameras, N): whether each component is NaN if a camera does not see a mark.

        The result is None if it may change over time: for a user's feature, or for a feature that
        is NaN in this observation.
        """
        return None if self._compiled_feature is None else self.find_dependencies(seen)

    def find_dependencies(self, seen: Observation) -> NDArray[np.bool_] | None:
        """Return the result of `depends` for one observation, also for a user's feature."""
        if self.gone(seen).any():
            return None
        cameras, N = len(self.sights), len(seen.pixels_last)
        hidden = np.eye(cameras * N, dtype=np.bool_).reshape(cameras, N, -1)
        missing = self.gone(seen.repeated(cameras * N).blind(list(hidden)))
        return missing.reshape(-1, cameras, N)

    def _check_returned(self, value: Any, seen: Observation, *tail: int) -> Array:
        """Return the chosen components of a returned array, run last, after a shape check."""
        k = "k" if self.k is None else self.k
        expected = (seen.pixels_last.shape[-1], k, *tail)
        array = check_returned_array(value, f"{self.name}: a method", expected)
        # a copy, since the user may change the array later
        return np.array(self._select_components(view_runs_last(array)), order="C")

    def _select_components(self, array: Array) -> Array:
        """Return the chosen components; raise InputError for a component that does not exist."""
        if self.components is None:
            return array
        if self.components.max() >= len(array):
            raise InputError(
                f"{self.name} has {len(array)} components, numbered from 0; "
                f"there is no {self.components.max()}"
            )
        return array[self.components]
