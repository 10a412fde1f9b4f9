"""Image points, normalised or in pixels: the features of the chapter's section 5.2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.declare import Declared, register
from robsim.features.feature import Observation, Tolerance
from robsim.kernels import features as kernels


@register("feature", "points")
@dataclass(frozen=True)
class Points(Declared):
    """Normalised, undistorted image points, s = (x1, y1, x2, y2, ...).

    L is eq. (14) of the chapter with f = 1 (Chaumette and Hutchinson 2006, eq. 11).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = np.array([[[0.1], [0.2]]]), np.array([[2.0]])
    >>> Points().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.1, 0.2]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "1"

    def measure(self, seen: Observation) -> Array:
        """Return s (B, 2N)."""
        x = seen.points_last
        return first_view(x.reshape(-1, x.shape[-1]))

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, 2N, 6)."""
        x = seen.points_last
        L = np.empty((2 * x.shape[0], 6, x.shape[-1]))
        kernels.points_interaction(x, seen.depth_last, L)
        return first_view(L)


@register("feature", "pixels")
@dataclass(frozen=True)
class PixelPoints(Declared):
    """Undistorted pixels, s = (column1, row1, column2, row2, ...).

    L is that of the normalised points times the focal lengths (and skew) of K.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> seen = Observation.of(np.array([[[400.0], [240.0]]]), np.array([[2.0]]), camera)
    >>> PixelPoints().interaction(seen)[0, 0, :3]
    array([-400.,    0.,   40.])
    """

    tolerance: Tolerance = 0.01
    unit: str = "px"

    def measure(self, seen: Observation) -> Array:
        """Return s (B, 2N)."""
        x = seen.points_last
        s = np.empty((2 * x.shape[0], x.shape[-1]))
        kernels.to_pixels(x, seen.K, s)
        return first_view(s)

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, 2N, 6)."""
        x = seen.points_last
        L = np.empty((2 * x.shape[0], 6, x.shape[-1]))
        kernels.points_interaction(x, seen.depth_last, L)
        kernels.to_pixel_rates(seen.K, L)
        return first_view(L)
