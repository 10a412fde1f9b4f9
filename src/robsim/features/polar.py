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

    In the image at unit depth, rho = sqrt(x^2 + y^2) and theta = atan2(y, x) in radians. With
    c = cos(theta) and s = sin(theta), the rows of L are

        L_rho   = [-c/Z, -s/Z, rho/Z, (1 + rho^2) s, -(1 + rho^2) c, 0]
        L_theta = [s/(rho Z), -c/(rho Z), 0, c/rho, s/rho, -1]

    (Iwatsuki and Okiyama 2005; Chaumette and Hutchinson 2007, on cylindrical coordinates; Corke,
    Spindler and Chaumette 2009). They are the two rows of `Points`, rotated by theta, with the
    second row divided by rho.

    Use polar coordinates if the camera must rotate far about its optical axis: the points then
    move on circles about the principal point, and the camera does not retreat. For lateral
    translations `Points` gives the more direct path.

    Notes
    -----
    A mark at the principal point has no angle: theta is 0 and L is NaN. `towards` sets the goal;
    theta is then within half a turn, (-pi, pi], of its value at the goal.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.3, 0.4]], [2.0]
    >>> Polar().measure(Observation.of(pixels, depth, Camera(np.eye(3)))).round(4)
    array([[0.5   , 0.9273]])
    """

    stage: ClassVar[CompiledStage] = kernels.polar_stage
    each: ClassVar[int] = 2
