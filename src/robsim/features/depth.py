"""The depth of each mark relative to its depth at the goal."""

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
    """Logarithm of the ratio of each depth to the depth at the goal, s = (log(Z1/Z1_goal), ...).

    Each mark contributes the row

        L = [0, 0, -1/Z, -y, x, 0]

    (Malis, Chaumette and Boudet 1999, who obtain the ratio of the depths from a homography). The
    error decays exponentially in log Z, so the camera approaches fast from far away and slowly
    near the goal. The feature fixes the motion along the optical axis; combine it with points and
    a rotation, as `Hybrid` does. The depth of the task must be "true" or a `DepthFilter`.

    Raises
    ------
    InputError
        By `simulate`, if the depth of the task is neither "true" nor a `DepthFilter`; by
        `measure`, if the number of marks differs from the goal.

    Notes
    -----
    The depth at the goal is 1 m until `towards` is called. A mark that is not in front of the
    camera has no finite s.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, camera = [[0.1, 0.2]], Camera(np.eye(3))
    >>> far, near = (Observation.of(pixels, [Z], camera) for Z in (2.0, 0.5))
    >>> LogDepth().towards(near).measure(far).round(4)  # log 4
    array([[1.3863]])
    """

    Z_goal: Array | None = field(default=None, init=False, repr=False)  # (N, B), by `towards`
    measures_depth: ClassVar[bool] = True

    def towards(self, goal: Observation) -> LogDepth:
        """Return the feature relative to the depths at the goal.

        Parameters
        ----------
        goal : Observation
            Observation of the marks at the goal.

        Returns
        -------
        LogDepth
            The feature with `Z_goal` from the observation.

        Raises
        ------
        InputError
            If `goal` is not an Observation.
        """
        return replace_unchecked(self, Z_goal=check_goal_observation(goal, "LogDepth").depth_last)

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        Z_goal = seen.goal(np.ones((seen.N, 1)) if self.Z_goal is None else self.Z_goal, seen.N)
        return seen.computed(kernels.log_depth_stage, seen.N, **seen.image, goal=Z_goal)
