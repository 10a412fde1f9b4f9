"""The depth of the marks relative to that at the goal."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.value import replace_unchecked
from robsim.declare import register
from robsim.features.feature import Observation, check_goal_observation
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import point_features as kernels


@register("feature", "log_depth")
@dataclass(frozen=True, eq=False)
class LogDepth(MarkFeature):
    """The logarithm of each mark's depth over its depth at the goal, s = (log(Z1/Z1_goal), ...).

    L = [0, 0, -1/Z, -y, x, 0] (Malis, Chaumette and Boudet 1999, where the ratio of the depths
    comes from a homography). Until a goal is given Z_goal is a metre. A mark that is not in front
    of the camera has no finite s.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, camera = [[0.1, 0.2]], Camera(np.eye(3))
    >>> far, near = (Observation.of(pixels, [Z], camera) for Z in (2.0, 0.5))
    >>> LogDepth().towards(near).measure(far).round(4)  # log 4
    array([[1.3863]])
    """

    Z_goal: Array | None = field(default=None, init=False, repr=False)  # (N, B) m, of `towards`
    measures_depth: ClassVar[bool] = True

    def towards(self, goal: Observation) -> LogDepth:
        """Return the feature relative to the depths at the goal."""
        return replace_unchecked(self, Z_goal=check_goal_observation(goal, "LogDepth").depth_last)

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        Z_goal = seen.goal(np.ones((seen.N, 1)) if self.Z_goal is None else self.Z_goal, seen.N)
        return seen.computed(kernels.log_depth_stage, seen.N, **seen.image, goal=Z_goal)
