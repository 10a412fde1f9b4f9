"""Depth estimated on line, from how the marks move in the image while the camera moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Declared, Length, Number, family, register
from robsim.kernels import depth_filter as kernels

DEPTHS = family("depth")


@register("depth", "filter")
@dataclass(frozen=True)
class DepthFilter(Declared):
    """The depth of each mark, estimated by an extended Kalman filter of (x, y, 1/Z).

    The motion of a mark under the believed twist of the camera is exact, and the filter allows it
    a drift of 1e-4 in the image and of 1 percent in depth per square root of a second. An
    estimate stays between 0.01 m and 100 m, and as it was while the camera does not move. A target
    that moves on its own is taken for parallax unless feed_forward="known" tells of it. Matthies,
    Kanade and Szeliski 1989, "Kalman filter-based algorithms for estimating depth from image
    sequences". Skew is neglected in the noise.

    >>> eye = np.diag([800.0, 800.0, 1.0])
    >>> state, P = DepthFilter(0.5).begin(np.zeros((1, 2, 1)), eye)
    >>> state.ravel(), DepthFilter.depth(state).ravel()
    (array([0., 0., 2.]), array([0.5]))
    """

    start: Annotated[float, Length(above=0), "Depth of every mark at the start."]
    start_sigma: Annotated[
        float, Number(above=0), "Relative standard deviation of 1/Z at the start."
    ] = 0.5
    noise: Annotated[
        float,
        Number(above=0, unit="px"),
        "Standard deviation of the noise on each pixel coordinate.",
    ] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not kernels.NEAREST <= self.start <= kernels.FARTHEST:
            raise InputError(
                f"start of the depth filter must lie between {kernels.NEAREST} m and "
                f"{kernels.FARTHEST} m, got {self.start}"
            )

    def begin(self, x: Array, K: Array) -> tuple[Array, Array]:
        """Return state (N, 3, B) and covariance (N, 3, 3, B) at the first points x (N, 2, B)."""
        N, _, runs = x.shape
        state, P = np.empty((N, 3, runs)), np.zeros((N, 3, 3, runs))
        state[:, :2], state[:, 2] = x, 1.0 / self.start
        sigma = *self._sigma(K), self.start_sigma / self.start
        P[:, range(3), range(3)] = np.square(sigma)[:, None]
        return state, P

    def step(
        self, state: Array, P: Array, V: Array, dt: float, x: Array, K: Array
    ) -> tuple[Array, Array]:
        """Return state and covariance after a twist V (6, B) is held for dt seconds.

        x (N, 2, B) are the points that are measured then.

        V is the camera's relative to the target, in camera axes.
        """
        new, covariance = np.empty(state.shape), np.empty(P.shape)
        kernels.predict(state, P, V, dt, new, covariance)
        kernels.update(new, covariance, x, self._sigma(K))
        return new, covariance

    @staticmethod
    def depth(state: Array) -> Array:
        """Return the depths (N, B) in metres of a state (N, 3, B)."""
        Z: Array = 1.0 / state[:, 2]
        return Z

    def _sigma(self, K: Array) -> Array:
        """Return the standard deviations (2,) of a normalised point."""
        return self.noise / np.abs(np.diagonal(K)[:2])
