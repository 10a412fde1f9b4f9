"""Image points on the unit sphere, as bearings."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import Declared, register
from robsim.features.compiled import Compiled
from robsim.features.feature import Tolerance
from robsim.features.rows import FeatureRows, Seen
from robsim.kernels.features import point_features as kernels


@register("feature", "spherical")
@dataclass(frozen=True)
class Spherical(Compiled, Declared):
    """Unit vectors from the camera to the marks, in camera axes, s = (s1, s2, ...), three each.

    L = [-(I - s s')/|P|, [s]x] with the distance |P| = Z sqrt(1 + x^2 + y^2) (Hamel and Mahony
    2002). A rotation of the camera turns every s alike, wherever it is in the image.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.75, 0.0]], [2.0]
    >>> Spherical().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.6, 0. , 0.8]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "1"

    def stages(self, seen: Seen) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        rows = seen.room(3 * seen.N)
        seen.program.add(
            kernels.bearings_stage, points=seen.points, depth=seen.depth, s=rows.s, L=rows.L
        )
        return rows
