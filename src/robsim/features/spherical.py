"""Image points on the unit sphere, as bearings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import point_features as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "spherical")
@dataclass(frozen=True)
class Spherical(MarkFeature):
    """Bearings: unit vectors from the camera to the marks in camera axes, three numbers each.

    For a mark at P in camera axes, s = P/|P| and

        L = [-(I - s s')/|P|, [s]x],    |P| = Z sqrt(1 + x^2 + y^2)

    (Hamel and Mahony 2002). A rotation of the camera rotates all bearings together, independent of
    their positions in the image. Use bearings for cameras with a wide field of view: normalised
    points grow without bound towards 90 degrees from the optical axis, and bearings do not.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.75, 0.0]], [2.0]
    >>> Spherical().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.6, 0. , 0.8]])
    """

    stage: ClassVar[CompiledStage] = kernels.bearings_stage
    each: ClassVar[int] = 3
