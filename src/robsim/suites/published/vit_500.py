"""ViT-500: 500 starts in a box above a target; some do not see all marks.

From the paper: the number of starts and their seed, the box of 1.2 x 1.2 x 0.3 m about
(0, 0, 0.61) m, viewed points on four circles 8 cm apart, the roll within 120 degrees, the focal
length, 1,500 steps, and the criterion of success. Chosen here: the target, a square of 20 cm in the
plane z = 0, the goal at the middle of the box, 640 x 480 pixels, a gain of 1 and 50 Hz.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.builtin_schemes import BUILT_IN, constrain_schemes
from robsim.suites.camera_poses import interpolate_range, look_at_points, make_flying_scene
from robsim.suites.suite import Suite, square_marks

STARTS, SEED = 500, 41
MIDDLE, HALF = np.array([0.0, 0.0, 0.61]), np.array([0.6, 0.6, 0.15])  # of the box, metres
GOAL = Pose.at(*MIDDLE, rpy=(np.pi, 0, 0))  # faces the square
FOCAL = 502.3  # pixels
CIRCLES, STEP = 4, 0.08  # radii are 8, 16, 24 and 32 cm


def suite() -> Suite:
    """Return the suite."""
    return Suite(
        "vit_500",
        1,
        "500 starts in a box above the target",
        'after "ViT-VS: On the Applicability of Pretrained Vision Transformer Features for '
        'Generalizable Visual Servoing", arXiv 2503.04545, 2025',
        "at the end within 10 % of the initial distance and angle, or within 1 cm and 1 degree",
        is_error_reduced,
        make_flying_scene(FOCAL, square_marks(0.2)),
        GOAL.q,
        _sample_box_starts().q,
        gain=1.0,
        dt=0.02,
        duration=30.0,
        schemes={
            **BUILT_IN,
            **constrain_schemes("in view", FieldOfView(), names=["PBVS, goal form"]),
        },
    )


def is_error_reduced(rows: pd.DataFrame) -> Any:
    """Return which runs meet the criterion of the paper, one truth value for each row."""
    distance, angle = rows["distance_to_goal"], rows["angle_to_goal"]
    reduced = distance <= 0.1 * rows["distance_at_start"]
    reduced &= angle <= 0.1 * rows["angle_at_start"]
    return reduced | ((distance < 0.01) & (angle < np.radians(1.0)))


def _sample_box_starts() -> Pose:
    """Return the poses (500,) of the camera at the start."""
    u = uniform(SEED, SUITES, STARTS, 6)
    positions = MIDDLE + HALF * interpolate_range(u[:, :3], -1.0, 1.0)
    return look_at_points(
        positions, _points_on_circles(u[:, 3], u[:, 4]), _sample_roll(u[:, 5]), GOAL.rotation[:, 1]
    )


def _points_on_circles(which: Array, turn: Array) -> Array:
    """Return points (N, 3) on the circles, from numbers (N,) in 0..1."""
    radius = STEP * (1 + np.floor(CIRCLES * which))
    angle = 2.0 * np.pi * turn
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)


def _sample_roll(u: Array) -> Array:
    """Return roll angles (N,) in radians from numbers u (N,) in 0..1."""
    return interpolate_range(u, -np.radians(120.0), np.radians(120.0))
