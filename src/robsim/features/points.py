"""Image points, normalised or in pixels: the features of the chapter's section 5.2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.feature import Tolerance
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import image_points as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "points")
@dataclass(frozen=True)
class Points(MarkFeature):
    """Normalised, undistorted image points, s = (x1, y1, x2, y2, ...).

    L is eq. (14) of the chapter with f = 1 (Chaumette and Hutchinson 2006, eq. 11).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.2]], [2.0]
    >>> Points().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.1, 0.2]])
    """

    stage: ClassVar[CompiledStage] = kernels.points_stage
    each: ClassVar[int] = 2


@register("feature", "pixels")
@dataclass(frozen=True)
class PixelPoints(Points):
    """Undistorted pixels, s = (column1, row1, column2, row2, ...).

    L is that of the normalised points times the focal lengths (and skew) of K.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> seen = Observation.of([[400, 240]], [2.0], camera)
    >>> PixelPoints().interaction(seen)[0, 0, :3]
    array([-400.,    0.,   40.])
    """

    tolerance: Tolerance = 0.01
    unit: str = "px"

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        rows = super().stages(seen)
        seen.program.add(kernels.pixels_stage, camera=seen.camera, **rows._asdict())
        return rows
