"""Image points, normalised or in pixels: the features of the chapter's section 5.2."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import Declared, register
from robsim.features.compiled import Compiled
from robsim.features.feature import Tolerance
from robsim.features.rows import FeatureRows, Seen
from robsim.kernels.features import points as kernels


@register("feature", "points")
@dataclass(frozen=True)
class Points(Compiled, Declared):
    """Normalised, undistorted image points, s = (x1, y1, x2, y2, ...).

    L is eq. (14) of the chapter with f = 1 (Chaumette and Hutchinson 2006, eq. 11).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.2]], [2.0]
    >>> Points().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.1, 0.2]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "1"

    def stages(self, seen: Seen) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        return point_rows(seen)


@register("feature", "pixels")
@dataclass(frozen=True)
class PixelPoints(Compiled, Declared):
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

    def stages(self, seen: Seen) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        rows = point_rows(seen)
        seen.program.add(kernels.pixels_stage, camera=seen.camera, s=rows.s, L=rows.L)
        return rows


def point_rows(seen: Seen) -> FeatureRows:
    """Add the stage of s and L of normalised points to a program, and return their rows."""
    rows = seen.room(2 * seen.N)
    seen.program.add(kernels.points_stage, points=seen.points, depth=seen.depth, s=rows.s, L=rows.L)
    return rows
