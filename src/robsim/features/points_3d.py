"""Points in space, from their image and depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.declare import Declared, register
from robsim.features.feature import Observation, Tolerance
from robsim.kernels import point_features as kernels


@register("feature", "points_3d")
@dataclass(frozen=True)
class Points3D(Declared):
    """The marks in camera axes, in metres, s = (X1, Y1, Z1, X2, ...) = (x1 Z1, y1 Z1, Z1, ...).

    L = [-I, [X]x] (Chaumette and Hutchinson 2007, on 3-D points).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> pixels, depth = np.array([[[0.1], [0.2]]]), np.array([[2.0]])
    >>> Points3D().measure(Observation.of(pixels, depth, Camera(np.eye(3))))
    array([[0.2, 0.4, 2. ]])
    """

    tolerance: Tolerance = 1e-5
    unit: str = "m"
    measures_depth: ClassVar[bool] = True

    def measure(self, seen: Observation) -> Array:
        """Return s (B, 3N) in metres."""
        return first_view(self._places(seen))

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, 3N, 6)."""
        X = self._places(seen)
        L = np.empty((X.shape[0], 6, X.shape[1]))
        kernels.points_3d_interaction(X, L)
        return first_view(L)

    @staticmethod
    def _places(seen: Observation) -> Array:
        x = seen.points_last
        X = np.empty((3 * x.shape[0], x.shape[-1]))
        kernels.points_3d(x, seen.depth_last, X)
        return X
