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
    """Lines through marks 0 and 1, 2 and 3 ..., s = (rho1, theta1, rho2, ...), two numbers each.

    A line satisfies x cos(theta) + y sin(theta) = rho in the image at unit depth, with theta in
    radians. The line runs from its first mark to its second in the direction
    (-sin(theta), cos(theta)); theta therefore covers a whole turn, rho has a sign, and both are
    smooth at rho = 0. With c = cos(theta) and s = sin(theta),

        L_rho   = lambda_rho   [c, s, -rho, 0, 0, 0] + [0, 0, 0, (1 + rho^2) s, -(1 + rho^2) c, 0]
        L_theta = lambda_theta [c, s, -rho, 0, 0, 0] + [0, 0, 0, -rho c, -rho s, -1]
        lambda_rho = (a rho c + b rho s + d)/e,    lambda_theta = (a s - b c)/e,

    for any plane a X + b Y + d Z + e = 0 that contains the line (Espiau, Chaumette and Rives
    1992). RobSim takes the plane from the depths of the marks.

    Use lines for edges, walls, pipes and lanes. A translation along a line does not change its
    image, so one line fixes two motions of the camera; three lines in general position fix six.
    Use `Segments` if the ends of the line are visible and matter.

    Raises
    ------
    InputError
        If the number of marks is odd.

    Notes
    -----
    Two marks at one point of the image give NaN. `towards` sets the goal; theta is then within
    half a turn, (-pi, pi], of its value at the goal.

    Examples
    --------
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
    """Intersection of the lines through marks 0, 1 and 2, 3 in the image, s = (x, y), normalised.

    The two lines must be parallel in space. Then s is the image of their point at infinity, and L
    is the matrix of a point with 1/Z = 0,

        L = [0, 0, 0,     x y, -(1 + x^2),  y]
            [0, 0, 0, 1 + y^2,       -x y, -x]

    The point depends on the rotation of the camera only, and L on no depth: regulate it to align a
    camera with a corridor, a facade or rails, and leave the translation to another feature. Eight
    marks give two points, and so on.

    Raises
    ------
    InputError
        If the number of marks is not a multiple of four.

    Notes
    -----
    If the lines are parallel in the image, the point is at infinity, and s is huge or not finite.

    Examples
    --------
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
