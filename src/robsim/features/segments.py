"""Line segments in the image, each between two marks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.mark_feature import AngleFeature
from robsim.kernels.features import line_features as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "segments")
@dataclass(frozen=True, eq=False)
class Segments(AngleFeature):
    """Segments between marks 0 and 1, 2 and 3 ..., s = (xc, yc, length, angle, ...), four each.

    (xc, yc) is the middle in the image at unit depth, the angle that of the way from the first
    mark to the second, in radians: length (cos, sin) = (x1 - x0, y1 - y0). L is that of the two
    ends through these relations (Espiau, Chaumette and Rives 1992; Chaumette 1990, thesis).

    Two marks at one place in the image have length 0, and L there is NaN. Towards a goal, the
    angle is the one within half a turn, (-pi, pi], of that at the goal. InputError: an odd number
    of marks.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.2], [0.4, 0.6]], [1.0, 1.0]
    >>> Segments().measure(Observation.of(pixels, depth, Camera(np.eye(3)))).round(4)
    array([[0.25  , 0.4   , 0.5   , 0.9273]])
    """

    stage: ClassVar[CompiledStage] = kernels.segments_stage
    each: ClassVar[int] = 4
    least_marks: ClassVar[int] = 2
