"""Depth estimated on line, from how the marks move in the image while the camera moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Length, Number, PerRun, family, register
from robsim.kernels.estimation import inverse_depth_filter as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.controller_rows import ControllerInputs

DEPTHS = family("depth")


@register("depth", "filter")
@dataclass(frozen=True)
class DepthFilter(DeclaredValue):
    """The depth of each mark, estimated by an extended Kalman filter of (x, y, 1/Z).

    The motion of a mark under the believed twist of the camera is exact, and the filter allows it
    a drift of 1e-4 in the image and of 1 percent in depth per square root of a second. An
    estimate stays between 0.01 m and 100 m, and as it was while the camera does not move. A target
    that moves on its own is taken for parallax unless feed_forward="known" tells of it. Matthies,
    Kanade and Szeliski 1989, "Kalman filter-based algorithms for estimating depth from image
    sequences". Skew is neglected in the noise.

    >>> DepthFilter(0.5).start_sigma
    0.5
    """

    start: Annotated[float, Length(above=0), PerRun(()), "Depth of every mark at the start."]
    start_sigma: Annotated[
        float, Number(above=0), PerRun(()), "Relative standard deviation of 1/Z at the start."
    ] = 0.5
    noise: Annotated[
        float,
        Number(above=0, unit="px"),
        PerRun(()),
        "Standard deviation of the noise on each pixel coordinate.",
    ] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not kernels.NEAREST <= self.start <= kernels.FARTHEST:
            raise InputError(
                f"start of the depth filter must lie between {kernels.NEAREST} m and "
                f"{kernels.FARTHEST} m, got {self.start}"
            )

    def stages(
        self, given: ControllerInputs, points: BlockRows, twist: BlockRows, K: Array
    ) -> BlockRows:
        """Add the stage that filters the depths of marks, and return its rows."""
        program, N = given.program, points.shape[0]
        sigma = self.noise / np.abs(np.atleast_3d(K)[[0, 1], [0, 1]])  # of a normalised point
        numbers = np.broadcast_arrays(1.0 / self.start, self.start_sigma / self.start, *sigma)
        return program.result(
            kernels.filter_depths,
            "depth",
            N,
            points=points,
            dt=given.dt,
            twist=twist,
            numbers=program.each(numbers),
            estimate=program.rows(N, 3),
            covariance=program.rows(N, 3, 3),
            room=program.rows(12 * N),
        )
