"""The ellipse that a circle in space projects to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import conics as kernels
from robsim.kernels.formulas.image_moments import ORDER_3


@register("feature", "ellipse")
@dataclass(frozen=True)
class Ellipse(MarkFeature):
    """The image of a circle or ellipse on which the marks lie, s = (xg, yg, n20, n11, n02).

    (xg, yg) is the centre of the ellipse in the image (not the image of the circle's centre) and
    n_ij = mu_ij / area are its second moments, all in normalised coordinates: semi-axes p and q
    have n = p^2 / 4 and q^2 / 4 along them. The ellipse is the conic through five marks, or nearest
    to more in the sense of algebraic least squares; s is NaN if that conic is no ellipse or the
    marks do not fix one. L needs the plane of the marks, fitted to their depths. A circle looks the
    same from wherever it gives one ellipse: L has rank 5 at most. Chaumette 2004, Image moments:
    a general and useful set of features for visual servoing, IEEE T-RO 20(4).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> t = np.arange(5) * 2 * np.pi / 5
    >>> circle = np.stack([0.1 + 0.2 * np.cos(t), 0.2 * np.sin(t)], 1)
    >>> seen = Observation.of(circle, np.ones(5), Camera(np.eye(3)))
    >>> Ellipse().measure(seen).round(12) + 0.0
    array([[0.1 , 0.  , 0.01, 0.  , 0.01]])
    """

    least_marks: ClassVar[int] = 5

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        room = seen.program.rows
        made = {"centre": room(2), "mu": room(ORDER_3), "ABC": room(3), "R": room(6, 6)}
        return seen.computed(kernels.ellipse_stage, 5, **seen.image, **made)
