"""Image points on the unit sphere, as bearings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.declare import Declared, register
from robsim.features.feature import Observation, Tolerance
from robsim.kernels import point_features as kernels


@register("feature", "spherical")
@dataclass(frozen=True)
class Spherical(Declared):
    """Unit vectors from the camera to the marks, in camera axes, s = (s1, s2, ...), three each.

    L = [-(I - s s')/|P|, [s]x] with the distance |P| = Z sqrt(1 + x^2 + y^2) (Hamel and Mahony
    2002). A rotation of the camera turns every s alike, wherever it is in the image.

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = np.array([[[0.75], [0.0]]]), np.array([[2.0]])
    >>> Spherical().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.6, 0. , 0.8]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "1"

    def measure(self, seen: Observation) -> Array:
        """Return s (B, 3N)."""
        return first_view(self._bearings(seen))

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, 3N, 6)."""
        s = self._bearings(seen)
        L = np.empty((s.shape[0], 6, s.shape[1]))
        kernels.bearings_interaction(s, seen.depth_last, L)
        return first_view(L)

    @staticmethod
    def _bearings(seen: Observation) -> Array:
        x = seen.points_last
        s = np.empty((3 * x.shape[0], x.shape[-1]))
        kernels.bearings(x, s)
        return s
