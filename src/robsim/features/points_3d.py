"""Points in space, reconstructed from their image and depth."""

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
    """Position of each mark in camera axes, in metres, s = (X1, Y1, Z1, X2, ...).

    The position is (x Z, y Z, Z) for a normalised image point (x, y) at depth Z. Each mark
    contributes the rows L = [-I, [X]x] (Chaumette and Hutchinson 2007, on 3-D points).

    The rows do not divide by depth, so they stay well conditioned at any distance. An error of the
    depth enters s itself, not only L. The image is not regulated: marks may leave it. The depth of
    the task must be "true" or a `DepthFilter`.

    Raises
    ------
    InputError
        By `simulate`, if the depth of the task is neither "true" nor a `DepthFilter`.

    Examples
    --------
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
