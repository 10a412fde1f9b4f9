"""Image points in polar coordinates, which suit large rotations about the optical axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.mark_feature import AngleFeature
from robsim.kernels.features import point_features as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "polar")
@dataclass(frozen=True, eq=False)
class Polar(AngleFeature):
    """Polar coordinates of image points about the principal point, s = (rho1, theta1, ...).

    rho = sqrt(x^2 + y^2) in the image at unit depth, theta = atan2(y, x) in radians; L is that of
    the points turned by theta, its second row over rho:
    L_rho = [-c/Z, -s/Z, rho/Z, (1 + rho^2) s, -(1 + rho^2) c, 0],
    L_theta = [s/(rho Z), -c/(rho Z), 0, c/rho, s/rho, -1], with c, s = cos theta, sin theta
    (Iwatsuki and Okiyama 2005; Chaumette and Hutchinson 2007, on cylindrical coordinates; Corke,
    Spindler and Chaumette 2009).

    A mark at the principal point has no theta: it is measured as 0, and L there is NaN.
    Towards a goal, theta is the one within half a turn, (-pi, pi], of that at the goal.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.3, 0.4]], [2.0]
    >>> Polar().measure(Observation.of(pixels, depth, Camera(np.eye(3)))).round(4)
    array([[0.5   , 0.9273]])
    """

    stage: ClassVar[CompiledStage] = kernels.polar_stage
    each: ClassVar[int] = 2
