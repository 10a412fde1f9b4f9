"""Points in space, seen by a pair of cameras that are fixed to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.base.errors import InputError
from robsim.declare import Declared, register
from robsim.features.compiled import Compiled
from robsim.features.feature import Tolerance
from robsim.features.rows import FeatureRows, Seen
from robsim.kernels import stereo as kernels


@register("feature", "stereo_points")
@dataclass(frozen=True)
class StereoPoints(Compiled, Declared):
    """Marks in axes of the first camera, s = (X1, Y1, Z1, X2, ...) in metres, by triangulation.

    L = [-I, [X]x] for each mark, as Xdot = -v - omega x X (Chaumette and Hutchinson 2006). NaN
    where the rays of both cameras to a mark are parallel.

    >>> import numpy as np
    >>> from robsim import Camera, Observation
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

    def stages(self, seen: Seen) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        if seen.other is None:
            raise InputError("StereoPoints needs what a second camera sees; here is none")
        rows = seen.room(3 * seen.N)
        seen.program.add(
            kernels.stereo_stage,
            seen.N,
            seen.points,
            seen.other.points,
            seen.between,
            rows.s,
            rows.L,
        )
        return rows
