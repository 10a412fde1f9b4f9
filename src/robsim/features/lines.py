"""Straight lines in the image, and vanishing points of parallel lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import AngleFeature, MarkFeature
from robsim.kernels.features import line_features as kernels
from robsim.kernels.machine.stages import CompiledStage


@register("feature", "lines")
@dataclass(frozen=True, eq=False)
class Lines(AngleFeature):
    """Lines through marks 0 and 1, 2 and 3 ..., s = (rho, theta, ...), two each.

    x cos theta + y sin theta = rho in the image at unit depth, theta in radians. The line runs
    from the first mark to the second in the direction (-sin theta, cos theta): so theta covers a
    whole turn, rho has a sign, and both go smoothly through rho = 0. With c, s = cos, sin theta,
    L_rho = lambda_rho [c, s, -rho, 0, 0, 0] + [0, 0, 0, (1 + rho^2) s, -(1 + rho^2) c, 0],
    L_theta = lambda_theta [c, s, -rho, 0, 0, 0] + [0, 0, 0, -rho c, -rho s, -1],
    lambda_rho = (a rho c + b rho s + d)/e, lambda_theta = (a s - b c)/e for any plane
    a X + b Y + d Z + e = 0 that holds the line (Espiau, Chaumette and Rives 1992); here they come
    from the depths of the marks.

    Two marks at one place in the image give NaN. Towards a goal, theta is the one within half a
    turn, (-pi, pi], of that at the goal. InputError: an odd number of marks.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = [[0.1, 0.0], [0.1, 0.3]], [1.0, 1.0]
    >>> Lines().measure(Observation.of(pixels, depth, Camera(np.eye(3))))  # x = 0.1, downwards
    array([[0.1, 0. ]])
    """

    stage: ClassVar[CompiledStage] = kernels.lines_stage
    each: ClassVar[int] = 2
    least_marks: ClassVar[int] = 2


@register("feature", "vanishing_point")
@dataclass(frozen=True)
class VanishingPoint(MarkFeature):
    """The point where the lines through marks 0, 1 and 2, 3 meet, s = (x, y), normalised.

    The lines must be parallel in space. Then s is the image of their point at infinity, and L is
    that of a point with 1/Z = 0: it depends on rotation only,
    L = [0, 0, 0, xy, -(1 + x^2), y; 0, 0, 0, 1 + y^2, -xy, -x]. Eight marks give two points, and
    so on. InputError: a number of marks that four does not divide.

    As the lines become parallel to the image the point goes to infinity; s is then huge or not
    finite.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> rails = [[-1, 1], [-0.5, 0.5], [1, 1], [0.5, 0.5]]
    >>> VanishingPoint().measure(Observation.of(rails, np.ones(4), Camera(np.eye(3))))
    array([[0., 0.]])
    """

    singular: ClassVar[str] = "edges that are parallel in the image meet nowhere in it"
    each: ClassVar[int] = 2
    least_marks: ClassVar[int] = 4
    uses_depth: ClassVar[bool] = False

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        return seen.computed(kernels.intersections_stage, self.count(seen.N), points=seen.points)
