"""Points in space, triangulated by two cameras with a fixed relative pose."""

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
    """Triangulated position of each mark in axes of the first camera, in metres.

    s = (X1, Y1, Z1, X2, ...) follows from the two images and the believed relative pose of the
    cameras. Each mark contributes the rows L = [-I, [X]x], since Xdot = -v - omega x X (Chaumette
    and Hutchinson 2006). No depth is needed. An error in the relative pose of the cameras enters
    s, as an error of the depth enters `Points3D`. Give the task both names, as in `camera=("left",
    "right")`.

    Raises
    ------
    InputError
        If the observation has no second camera.

    Notes
    -----
    A mark with parallel rays has no position: s is NaN.

    Examples
    --------
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
            raise InputError("StereoPoints needs the image of a second camera; there is none")
        arguments = {"points": seen.points, "others": seen.other.points, "T": seen.between}
        return seen.computed(kernels.stereo_stage, 3 * seen.N, **arguments)
