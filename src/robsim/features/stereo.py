"""Points in space, seen by a pair of cameras that are fixed to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.base.errors import InputError
from robsim.declare import Declared, register
from robsim.features.feature import Observation, Tolerance
from robsim.kernels import stereo as kernels
from robsim.kernels.point_features import points_3d_interaction


@register("feature", "stereo_points")
@dataclass(frozen=True)
class StereoPoints(Declared):
    """Marks in axes of the first camera, s = (X1, Y1, Z1, X2, ...) in metres, by triangulation.

    L = [-I, [X]x] for each mark, as Xdot = -v - omega x X (Chaumette and Hutchinson 2006). NaN
    where the rays of both cameras to a mark are parallel.

    >>> from robsim.vision.camera import Camera
    >>> left, right = np.array([[[0.1], [0.0]]]), np.array([[[0.0], [0.0]]])
    >>> camera, depth = Camera(np.eye(3)), np.array([[2.0]])
    >>> seen = Observation.of(left, depth, camera)
    >>> seen.other = Observation.of(right, depth, camera)
    >>> seen.between_last = np.eye(4)[:3, :, None] + 0.0
    >>> seen.between_last[0, 3] = 0.2
    >>> StereoPoints().measure(seen)
    array([[0.2, 0. , 2. ]])
    """

    cameras: ClassVar[int] = 2

    tolerance: Tolerance = 1e-5
    unit: str = "m"

    def measure(self, seen: Observation) -> Array:
        """Return s (B, 3N)."""
        X = _triangulated(seen)
        return first_view(X.reshape(-1, X.shape[-1]))

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix L (B, 3N, 6)."""
        X = _triangulated(seen)
        L = np.empty((3 * X.shape[0], 6, X.shape[-1]))
        points_3d_interaction(X.reshape(-1, X.shape[-1]), L)
        return first_view(L)


def _triangulated(seen: Observation) -> Array:
    """Return X (N, 3, B) in axes of the first camera."""
    if seen.other is None or seen.between_last is None:
        raise InputError("StereoPoints needs what a second camera sees; here is none")
    x = seen.points_last
    X = np.empty((x.shape[0], 3, x.shape[-1]))
    kernels.triangulate(x, seen.other.points_last, seen.between_last, X)
    return X
