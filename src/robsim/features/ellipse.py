"""The ellipse as the image of a circle in space."""

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
    """Image of a circle or ellipse through the marks, s = (xg, yg, n20, n11, n02).

    (xg, yg) is the centre of the ellipse in the image (not the image of the centre of the circle),
    and n_ij = mu_ij/area are its normalised second moments, all in the image at unit depth.
    Semi-axes p and q have n = p^2/4 and q^2/4 along them. The ellipse is the conic through five
    marks, or the algebraic least-squares fit to more marks. L needs the plane of the marks, which
    is fitted to their depths (Chaumette 2004, "Image moments: a general and useful set of features
    for visual servoing", IEEE T-RO 20(4)).

    Use it for holes, discs and wheels. A rotation of a circle about its axis does not change the
    image, so L has rank 5 at most and the camera may end with any roll about that axis.

    Raises
    ------
    InputError
        If the target has fewer than five marks.

    Notes
    -----
    s is NaN if the conic through the marks is no ellipse, or if the marks do not determine a
    conic.

    Examples
    --------
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
        rows = seen.program.rows
        scratch = {"centre": rows(2), "mu": rows(ORDER_3), "ABC": rows(3), "R": rows(6, 6)}
        return seen.computed(kernels.ellipse_stage, 5, **seen.image, **scratch)
