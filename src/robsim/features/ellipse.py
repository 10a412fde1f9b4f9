"""The ellipse that a circle in space projects to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.declare import Declared, register
from robsim.features.feature import Observation, Tolerance
from robsim.features.moments import region_plane
from robsim.kernels import conics as kernels
from robsim.kernels.moments import ORDER_3, region_rates


@register("feature", "ellipse")
@dataclass(frozen=True)
class Ellipse(Declared):
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
    >>> circle = np.stack([0.1 + 0.2 * np.cos(t), 0.2 * np.sin(t)], 1)[..., None]
    >>> seen = Observation.of(circle, np.ones((5, 1)), Camera(np.eye(3)))
    >>> Ellipse().measure(seen).round(12) + 0.0
    array([[0.1 , 0.  , 0.01, 0.  , 0.01]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "1"
    least_marks: ClassVar[int] = 5

    def measure(self, seen: Observation) -> Array:
        """Return s (B, 5)."""
        centre, mu = _fitted(seen)
        return first_view(np.concatenate([centre, mu[3:6]]))

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, 5, 6)."""
        centre, mu = _fitted(seen)
        R, L = np.empty((6, 6, mu.shape[1])), np.empty((5, 6, mu.shape[1]))
        region_rates(region_plane(seen), centre, mu, R)
        kernels.ellipse_rates(mu, R, L)
        return first_view(L)


def _fitted(seen: Observation) -> tuple[Array, Array]:
    """Return centre (2, B) and moments up to order 3 of the ellipse, divided by its area."""
    x = seen.points_last
    centre, mu = np.empty(x.shape[1:]), np.empty((ORDER_3, x.shape[2]))
    kernels.ellipse(x, centre, mu)
    return centre, mu
