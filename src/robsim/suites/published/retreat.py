"""Retreat: 500 starts that are turned by 90 to 180 degrees about the optical axis, and tilted.

The square, the goal 61 cm above it and the camera are those of `vit_500`. The camera starts within
20 cm of the goal along each axis, turned about its optical axis by 90 to 180 degrees (by exactly
180 degrees in every fifth start) and then tilted by up to 40 degrees about an axis in the image
plane, with all marks at least 8 pixels inside the image. Image-based servoing retreats from such
starts (Chaumette, "Potential problems of stability and convergence in image-based and
position-based visual servoing", 1998), and position-based servoing loses marks.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.servo.laws.rollout_law import RolloutLaw
from robsim.servo.tasks.schemes import IBVS, PBVS
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.builtin_schemes import BUILT_IN
from robsim.suites.camera_poses import SIZE, interpolate_range, make_flying_scene
from robsim.suites.published.large_rolls import is_at_goal
from robsim.suites.published.vit_500 import FOCAL, GOAL
from robsim.suites.suite import Suite, square_marks

STARTS, DRAWS, SEED = 500, 4000, 33
OFFSET = 0.2  # metres, along each axis
LEAST_TURN, MOST_TILT = np.radians(90.0), np.radians(40.0)
HALF_TURN_EVERY = 5  # one start in five is turned by exactly 180 degrees
MARGIN = 8.0  # pixels
LAW = RolloutLaw(["joint"], schemes=[PBVS(form="camera")])


def suite() -> Suite:
    """Return the suite."""
    return Suite(
        "retreat",
        1,
        "500 starts turned by 90 to 180 degrees about the optical axis, and tilted",
        'RobSim; after "Potential problems of stability and convergence in image-based and '
        'position-based visual servoing", F. Chaumette, 1998',
        "at the end within 1 cm and 1 degree of the goal",
        is_at_goal,
        make_flying_scene(FOCAL, square_marks(0.2)),
        GOAL.q,
        sample_turned_starts().q[:STARTS],
        gain=1.0,
        dt=0.02,
        duration=30.0,
        schemes={**BUILT_IN, "IBVS, looking ahead": IBVS(law=LAW)},
    )


def sample_turned_starts() -> Pose:
    """Return the sampled poses of the camera at the start that see all marks."""
    u = uniform(SEED, SUITES, DRAWS, 7)
    turn = interpolate_range(u[:, 3], LEAST_TURN, np.pi)
    turn[::HALF_TURN_EVERY] = np.pi
    turn *= np.where(u[:, 4] < 0.5, -1.0, 1.0)
    tilt, heading = MOST_TILT * u[:, 5], 2.0 * np.pi * u[:, 6]
    axes = np.stack([tilt * np.cos(heading), tilt * np.sin(heading), 0.0 * tilt], axis=1)
    roll = np.stack([0.0 * turn, 0.0 * turn, turn], axis=1)
    turned = GOAL @ Pose.at(rotvec=roll) @ Pose.at(rotvec=axes)
    matrices = turned.matrix.copy()
    matrices[:, :3, 3] += interpolate_range(u[:, :3], -OFFSET, OFFSET)
    return Pose(matrices[_sees_square(matrices)])


def _sees_square(T: Array) -> Any:
    """Return whether all marks are inside the image, for poses T (N, 4, 4) of the camera."""
    points = np.einsum("nji,nmj->nmi", T[:, :3, :3], square_marks(0.2) - T[:, None, :3, 3])
    half = (np.array(SIZE) - 1) / 2 - MARGIN
    pixels = FOCAL * points[..., :2] / points[..., 2:]
    return ((points[..., 2] > 0.0) & (np.abs(pixels) < half).all(axis=2)).all(axis=1)
