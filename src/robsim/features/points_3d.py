"""Points in space, from their image and depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import point_features as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "points_3d")
@dataclass(frozen=True)
class Points3D(MarkFeature):
    """The marks in camera axes, in metres, s = (X1, Y1, Z1, X2, ...) = (x1 Z1, y1 Z1, Z1, ...).

    L = [-I, [X]x] (Chaumette and Hutchinson 2007, on 3-D points).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.2]], [2.0]
    >>> Points3D().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.2, 0.4, 2. ]])
    """

    unit: str = "m"
    stage: ClassVar[CompiledStage] = kernels.points_3d_stage
    each: ClassVar[int] = 3
    measures_depth: ClassVar[bool] = True
