"""Points in space, seen by a pair of cameras that are fixed to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.base.errors import InputError
from robsim.declare import register
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import midpoint_triangulation as kernels


@register("feature", "stereo_points")
@dataclass(frozen=True)
class StereoPoints(MarkFeature):
    """Marks in axes of the first camera, s = (X1, Y1, Z1, X2, ...) in metres, by triangulation.

    L = [-I, [X]x] for each mark, as Xdot = -v - omega x X (Chaumette and Hutchinson 2006). NaN
    where the rays of both cameras to a mark are parallel.

    >>> from robsim import Camera, Pose
    >>> from robsim.features import Observation
    >>> camera = Camera(np.eye(3))
    >>> right = Observation.of([[0.0, 0.0]], [2.0], camera)
    >>> pair = {"other": right, "between": Pose.at(0.2, 0, 0)}
    >>> StereoPoints().measure(Observation.of([[0.1, 0.0]], [2.0], camera, **pair))
    array([[0.2, 0. , 2. ]])
    """

    cameras: ClassVar[int] = 2
    uses_depth: ClassVar[bool] = False

    unit: str = "m"

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        if seen.other is None:
            raise InputError("StereoPoints needs what a second camera sees; here is none")
        seen_by_both = {"points": seen.points, "others": seen.other.points, "T": seen.between}
        return seen.computed(kernels.stereo_stage, 3 * seen.N, **seen_by_both)
