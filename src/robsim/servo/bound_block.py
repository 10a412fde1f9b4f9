"""A feature block bound to a scene, which measures its feature and checks the shape."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, view_runs_last
from robsim.base.errors import InputError, format_value
from robsim.base.value import replace_unchecked
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Feature, Observation
from robsim.features.feature_rows import FeatureRows, ObservationRows, select_rows
from robsim.features.numeric_interaction import compute_interaction
from robsim.kernels.formulas.projection_arrays import Projection
from robsim.kernels.machine.program import Blocks
from robsim.servo.camera_target import CameraTarget, PairKey, compute_relative_pose
from robsim.servo.user_return import check_returned_array


@dataclass(frozen=True, eq=False)
class BoundBlock:
    """A feature block bound to a scene: its feature, measured by one camera or a stereo pair."""

    feature: Feature
    sights: tuple[CameraTarget, ...]  # as believed
    marks: NDArray[np.int64] | None
    components: NDArray[np.int64] | None
    weight: float
    k: int | None = None  # how many numbers its feature gives, once that is known

    @property
    def name(self) -> str:
        """The name of the feature's class."""
        return type(self.feature).__name__

    def towards(self, goal: Observation) -> BoundBlock:
        """Return the block measured relative to what is seen at the goal, if its feature can be."""
        towards = getattr(self.feature, "towards", None)
        if towards is None:
            return self
        feature = towards(goal)
        if not isinstance(feature, Feature):
            raise InputError(
                f"{self.name}.towards returned {format_value(feature)}, and no feature"
            )
        return replace(self, feature=feature)

    def counted(self, goal: Observation) -> BoundBlock:
        """Return the block with the size k that s has at the goal and must keep."""
        whole = replace(self, components=None)
        return replace(self, k=len(whole.measure(goal)))

    def observation(self, seen: ObservationRows, blocks: Blocks) -> Observation:
        """Return what all marks look like in blocks, before some are chosen."""
        cameras = [sight.eye.camera for sight in self.sights]
        return seen.observation(blocks, cameras)

    def at_goal(
        self, seen: dict[PairKey, Observation], projections: dict[PairKey, Projection]
    ) -> Observation:
        """Return what the feature is shown at the goal, with cameras where they are believed."""
        whole = self.all_at_goal(seen, projections)
        return whole if self.marks is None else whole.some(self.marks)

    def all_at_goal(
        self, seen: dict[PairKey, Observation], projections: dict[PairKey, Projection]
    ) -> Observation:
        """Return what all marks look like at the goal, before some are chosen."""
        first, *others = (sight.key for sight in self.sights)
        one = seen[first]
        for second in others:  # at most one
            between = compute_relative_pose(projections[first].T_w_c, projections[second].T_w_c)
            one = replace_unchecked(one, other=seen[second], between_last=between)
        return one

    def stages(self, seen: ObservationRows, with_L: bool = True) -> FeatureRows:
        """Add the stages of s and L to a program, and return the rows of the chosen components.

        A user's feature is asked for L only if that is wanted.
        """
        if self.marks is not None:
            seen = seen.some(self.marks)
        rows = self._whole(seen, with_L)
        if self.components is None:
            return rows
        return FeatureRows(*(select_rows(seen.program, each, self.components) for each in rows))

    def _whole(self, seen: ObservationRows, with_L: bool) -> FeatureRows:
        """Return the rows of all components, of a feature that may be a user's."""
        compiled = self._compiled
        if compiled is not None:
            return compiled.stages(seen)
        whole = replace(self, components=None)
        rows = seen.room(self.k or 0)

        def asked(blocks: Blocks, step: int) -> None:
            view = whole.observation(seen, blocks)
            blocks.put(rows.s, whole.measure(view))
            if with_L:
                blocks.put(rows.L, whole.interaction(view))

        seen.program.call(asked)
        return rows

    @property
    def _compiled(self) -> CompiledFeature | None:
        """The feature, if it is stages of a program and no user's."""
        feature = self.feature
        return feature if isinstance(feature, CompiledFeature) and not feature.is_own() else None

    @property
    def size(self) -> int:
        """The number of chosen components."""
        return len(self.components) if self.components is not None else self.k or 0

    def measure(self, seen: Observation) -> Array:
        """Return the chosen components s (k, B)."""
        return self._checked(self.feature.measure(seen), seen)

    def interaction(self, seen: Observation) -> Array:
        """Return L (k, 6, B) of the chosen components, for the first camera's twist."""
        return self._checked(compute_interaction(self.feature, seen), seen, 6)

    def gone(self, blind: Observation) -> NDArray[np.bool_]:
        """Return (k, B): which components are NaN, as marks of all the target's are."""
        if self.marks is not None:
            blind = blind.some(self.marks)
        try:
            return np.asarray(np.isnan(self.measure(blind)))
        except np.linalg.LinAlgError:  # of a user's feature: LAPACK takes no NaN for any run
            return np.ones((self.size, blind.pixels_last.shape[-1]), dtype=np.bool_)

    def depends(self, seen: Observation) -> NDArray[np.bool_] | None:
        """Return (k, cameras, N): which components are NaN where a camera does not see a mark.

        None where that may be another at another time: of a user's feature, or of one that has no
        value for what is seen.
        """
        return None if self._compiled is None else self.made_of(seen)

    def made_of(self, seen: Observation) -> NDArray[np.bool_] | None:
        """Return the same as `depends`, as it is for what is seen, also of a user's feature."""
        if self.gone(seen).any():
            return None
        cameras, N = len(self.sights), len(seen.pixels_last)
        each = np.eye(cameras * N, dtype=np.bool_).reshape(cameras, N, -1)
        gone = self.gone(seen.repeated(cameras * N).blind(list(each)))
        return gone.reshape(-1, cameras, N)

    def _checked(self, value: Any, seen: Observation, *tail: int) -> Array:
        """Return the chosen components of a returned array, run last; its shape is checked."""
        k = "k" if self.k is None else self.k
        wanted = (seen.pixels_last.shape[-1], k, *tail)
        array = check_returned_array(value, f"{self.name}: a method", wanted)
        return np.array(self._chosen(view_runs_last(array)), order="C")  # theirs may be used again

    def _chosen(self, array: Array) -> Array:
        if self.components is None:
            return array
        if self.components.max() >= len(array):
            raise InputError(
                f"{self.name} has {len(array)} components, numbered from 0; "
                f"there is no {self.components.max()}"
            )
        return array[self.components]
