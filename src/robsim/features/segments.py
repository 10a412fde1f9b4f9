"""Line segments in the image, each between two marks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from robsim.base.arrays import Array, frozen, last_view
from robsim.base.values import unchecked
from robsim.declare import Declared, register
from robsim.features.compiled import Compiled
from robsim.features.feature import Observation, Tolerance
from robsim.features.groups import check_groups
from robsim.features.rows import FeatureRows, Seen
from robsim.kernels.features import line_features as kernels


@register("feature", "segments")
@dataclass(frozen=True, eq=False)
class Segments(Compiled, Declared):
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

    tolerance: Tolerance = 1e-5
    unit: str = "1"
    goal: Array | None = field(default=None, init=False, repr=False)  # (2N, 1) of `towards`
    least_marks: ClassVar[int] = 2

    def towards(self, goal: Observation) -> Segments:
        """Return the feature with angles within half a turn of those at the goal."""
        return unchecked(self, goal=frozen(last_view(self.measure(goal))))

    def stages(self, seen: Seen) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        check_groups(seen.N, 2, "Segments")
        rows = seen.room(2 * seen.N)
        seen.program.add(
            kernels.segments_stage,
            points=seen.points,
            depth=seen.depth,
            goal=seen.goal(self.goal, 2 * seen.N),
            s=rows.s,
            L=rows.L,
        )
        return rows
