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
    """Segments between marks 0 and 1, 2 and 3 ..., s = (xc, yc, length, angle, ...).

    Each segment gives four numbers. (xc, yc) is the midpoint in the image at unit depth, and

        length (cos(angle), sin(angle)) = (x1 - x0, y1 - y0)

    with the angle in radians from the first mark to the second. L follows from the matrices of the
    two end points through these relations (Espiau, Chaumette and Rives 1992; Chaumette 1990,
    thesis).

    Length and angle separate the distance and the roll of the camera from its lateral motion: a
    pure approach changes mainly the length, a pure roll mainly the angle. Use `components` of
    `FeatureBlock` to regulate one of the four numbers, as `Partitioned` does with the angle.

    Raises
    ------
    InputError
        If the number of marks is odd.

    Notes
    -----
    Two marks at one point of the image have length 0, and L is NaN. `towards` sets the goal; the
    angle is then within half a turn, (-pi, pi], of its value at the goal.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.2], [0.4, 0.6]], [1.0, 1.0]
    >>> Segments().measure(Observation.of(pixels, depth, Camera(np.eye(3)))).round(4)
    array([[0.25  , 0.4   , 0.5   , 0.9273]])
    """

    stage: ClassVar[CompiledStage] = kernels.segments_stage
    each: ClassVar[int] = 4
    least_marks: ClassVar[int] = 2
