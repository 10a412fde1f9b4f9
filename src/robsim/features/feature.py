"""A feature: how a vector s and its interaction matrix come from what a camera observes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from robsim.arrays import Array, shown_view
from robsim.camera import Camera
from robsim.kernels import camera as kernels


@dataclass(eq=False)  # not frozen: one is made in every step
class Observation:
    """What the controller knows of N marks at one instant, for B runs.

    Names that end in `_last` are in the kernels' layout, the run last; the properties beside them
    are run-first views of the same numbers, for features written in plain NumPy.
    """

    pixels_last: Array  # (N, 2, B) measured pixels (column, row)
    points_last: Array  # (N, 2, B) the same, normalised: undistorted, at unit depth
    depth_last: Array  # (N, B) metres, as the controller believes it
    K: Array  # (3, 3) intrinsics as the controller believes them
    lens: Array  # (8,) distortion likewise

    @property
    def pixels(self) -> Array:
        """(B, N, 2) measured pixels (column, row)."""
        return shown_view(self.pixels_last)

    @property
    def points(self) -> Array:
        """(B, N, 2) normalised image points (x, y): undistorted, at unit depth."""
        return shown_view(self.points_last)

    @property
    def depth(self) -> Array:
        """(B, N) depths in metres, as the controller believes them."""
        return shown_view(self.depth_last)

    @classmethod
    def of(cls, pixels: Array, depth: Array, camera: Camera) -> Observation:
        """What a camera makes of pixels (N, 2, B) at depths (N, B) in metres."""
        points = np.empty_like(pixels)
        kernels.normalise(pixels, camera.K, camera.lens, camera.reach, points)
        return cls(pixels, points, depth, camera.K, camera.lens)


@runtime_checkable
class Feature(Protocol):
    """What anything must have to be servoed on: a user's class needs no base class.

    `unit` is that of s, `tolerance` the largest |e| that counts as arrived. To give the same bits
    in any batch, compute element by element over the runs (see `robsim.testing.check_feature`).
    """

    @property
    def unit(self) -> str:
        """Unit of s, such as "px" or "1"."""

    @property
    def tolerance(self) -> float:
        """A run has converged when max|e| is below this."""

    def measure(self, seen: Observation) -> Array:
        """Features s (B, k)."""

    def interaction(self, seen: Observation) -> Array:
        """Interaction matrix L (B, k, 6) with sdot = L V_c, V_c = (v, omega) in camera axes."""
