"""Depth estimated on line, from the motion of the marks in the image and of the camera."""

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
    """Depth of each mark, estimated by an extended Kalman filter of (x, y, 1/Z).

    The prediction moves each mark by the believed twist of the camera, which is exact for a fixed
    target; process noise allows a drift of 1e-4 in the image and of 1 percent in depth per square
    root of a second. The correction is the measured image point (Matthies, Kanade and Szeliski
    1989, "Kalman filter-based algorithms for estimating depth from image sequences").

    Use it if the depth is unknown: parallax reveals the depth while the camera translates. The
    estimate does not change while the camera stands, and a rotation about the centre of the camera
    gives no information. A wrong `start` makes the first translation too fast or too slow.
    `start_sigma` sets the confidence in `start`, and `noise` the confidence in the image.

    Raises
    ------
    InputError
        If `start` is not between 0.01 m and 100 m.

    Notes
    -----
    An estimate stays between 0.01 m and 100 m. The motion of a moving target counts as parallax,
    unless feed_forward="known" provides it. The noise model neglects the skew of the camera.

    Examples
    --------
    The true depth at the start is 1 m:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> for depth in 0.3, rs.laws.DepthFilter(start=0.3):
    ...     task = rs.IBVS(scenario.task.goal, features="pixels", depth=depth, tolerance=0.1)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=25)
    ...     print(rs.Outcome(int(run.outcome)).name, f"{float(run.end_time):.1f} s")
    CONVERGED 20.2 s
    CONVERGED 7.6 s
    """

    start: Annotated[
        float, Length(above=0), PerRun(()), "First estimate of the depth of every mark, in metres."
    ]
    start_sigma: Annotated[
        float, Number(above=0), PerRun(()), "Relative standard deviation of 1/Z at the start."
    ] = 0.5
    noise: Annotated[
        float,
        Number(above=0, unit="px"),
        PerRun(()),
        "Standard deviation of the noise of each pixel coordinate, in pixels.",
    ] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not kernels.NEAREST <= self.start <= kernels.FARTHEST:
            raise InputError(
                f"start of the depth filter must lie between {kernels.NEAREST} m and "
                f"{kernels.FARTHEST} m, got {self.start}"
            )

    def stages(
        self, inputs: ControllerInputs, points: BlockRows, twist: BlockRows, K: Array
    ) -> BlockRows:
        """Add the stage that filters the depths of the marks; return its rows."""
        program, N = inputs.program, points.shape[0]
        sigma = self.noise / np.abs(np.atleast_3d(K)[[0, 1], [0, 1]])  # of a normalised point
        numbers = np.broadcast_arrays(1.0 / self.start, self.start_sigma / self.start, *sigma)
        return program.result(
            kernels.filter_depths,
            "depth",
            N,
            points=points,
            dt=inputs.dt,
            twist=twist,
            numbers=program.each(numbers),
            estimate=program.rows(N, 3),
            covariance=program.rows(N, 3, 3),
            scratch=program.rows(12 * N),
        )
