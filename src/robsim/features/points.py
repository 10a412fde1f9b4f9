"""Image points, normalised or in pixels (chapter, section 5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.feature import Tolerance
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import point_features as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "points")
@dataclass(frozen=True)
class Points(MarkFeature):
    """Normalised image points, s = (x1, y1, x2, y2, ...).

    A point of the image at unit depth is x = X/Z, y = Y/Z for a mark at (X, Y, Z) in camera axes;
    the distortion of the lens is removed. Each mark contributes two rows of L,

        [-1/Z,    0, x/Z,     x y, -(1 + x^2),  y]
        [   0, -1/Z, y/Z, 1 + y^2,       -x y, -x]

    (chapter, eq. 14 with f = 1; Chaumette and Hutchinson 2006, eq. 11).

    The points are the usual choice for `IBVS`. They move on nearly straight lines in the image, so
    the marks rarely leave it. The path of the camera is free: under a large rotation about the
    optical axis the camera retreats, and under a rotation by pi it moves straight back without
    end. `Polar` avoids the retreat. Three marks leave four possible poses of the camera; use four
    or more.

    Examples
    --------
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
    """Undistorted image points in pixels, s = (column1, row1, column2, row2, ...).

    The interaction matrix is the matrix of `Points` times the focal lengths (and the skew) of the
    believed K. If both focal lengths are equal and the skew is zero, all rows have one factor, and
    the camera moves as with `Points`. Use this feature to give the tolerance, the noise and the
    error in pixels.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> seen = Observation.of([[400, 240]], [2.0], camera)
    >>> PixelPoints().measure(seen)
    array([[400., 240.]])
    >>> PixelPoints().interaction(seen)[0, 0, :3]
    array([-400.,    0.,   40.])
    """

    tolerance: Tolerance = 0.01
    unit: str = "px"

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        rows = super().stages(seen)
        seen.program.add(kernels.pixels_stage, camera=seen.camera, **rows.numbers)
        return rows
