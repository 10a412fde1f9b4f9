"""Points in space, from their image and depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import Declared, register
from robsim.features.compiled import Compiled
from robsim.features.feature import Tolerance
from robsim.features.rows import FeatureRows, Seen
from robsim.kernels.features import point_features as kernels


@register("feature", "points_3d")
@dataclass(frozen=True)
class Points3D(Compiled, Declared):
    """The marks in camera axes, in metres, s = (X1, Y1, Z1, X2, ...) = (x1 Z1, y1 Z1, Z1, ...).

    L = [-I, [X]x] (Chaumette and Hutchinson 2007, on 3-D points).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.2]], [2.0]
    >>> Points3D().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.2, 0.4, 2. ]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "m"
    measures_depth: ClassVar[bool] = True

    def stages(self, seen: Seen) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        rows = seen.room(3 * seen.N)
        seen.program.add(
            kernels.points_3d_stage, points=seen.points, depth=seen.depth, s=rows.s, L=rows.L
        )
        return rows
