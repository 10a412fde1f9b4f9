"""Oblique pairs: pairs of start and goal up to 45 degrees from the normal of the target.

The camera, the target, the scales, the thirds by the angle between start and goal, the rate and the
number of steps are those of `cns_150`. The pairs are sampled here: both cameras are within 45
degrees of the normal of the square, 0.5 to 1 m away, look at a point within 5 cm of its middle, and
have any roll.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.run.end_variables import compute_rotation_angle
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.camera_poses import (
    directions_in_cap,
    interpolate_range,
    look_at_points,
    make_flying_scene,
)
from robsim.suites.published.cns_150 import FOCAL, PAIRS, SIDE, THIRDS, scale_pairs
from robsim.suites.suite import Suite, square_marks

DRAWS = 4000  # samples, enough for each third


def suite() -> Suite:
    """Return the suite."""
    return Suite(
        "oblique_pairs",
        1,
        "150 pairs of start and goal, up to 45 degrees from the normal of the target",
        'RobSim; ranges and scales after "CNS: Correspondence Encoded Neural Image Servo Policy", '
        "arXiv 2309.09047, 2023",
        "at the end within 10 % of the initial distance and within 10 degrees of the goal",
        is_within_tenth,
        make_flying_scene(FOCAL, square_marks(SIDE)),
        Pose(np.eye(4)).q,
        **scale_pairs(*_sample_pairs()),
    )


def is_within_tenth(rows: pd.DataFrame) -> Any:
    """Return which runs end within a tenth of the initial distance, one value for each row."""
    near = rows["distance_to_goal"] <= 0.1 * rows["distance_at_start"]
    return near & (rows["angle_to_goal"] <= np.radians(10.0))


def _sample_pairs() -> tuple[Pose, Pose]:
    """Return T_goal_o and T_goal_start (150,) of all pairs, third after third."""
    u = uniform(0, SUITES, DRAWS, 12)
    goal, start = _sample_cameras(u[:, :6]), _sample_cameras(u[:, 6:])
    apart = goal.inv() @ start
    turn = np.degrees(compute_rotation_angle((apart.rotation - np.eye(3)).reshape(-1, 9).T))
    inside = [np.flatnonzero((turn >= low) & (turn <= high))[: PAIRS // 3] for low, high in THIRDS]
    chosen = np.concatenate(inside)
    return goal.inv()[chosen], apart[chosen]


def _sample_cameras(u: Array) -> Pose:
    """Return poses of cameras that look at the square, from numbers u (N, 6) in 0..1."""
    positions = directions_in_cap(u[:, :2], np.radians(45.0)) * interpolate_range(
        u[:, 2:3], 0.5, 1.0
    )
    at = np.pad(interpolate_range(u[:, 3:5], -0.05, 0.05), ((0, 0), (0, 1)))
    return look_at_points(
        positions, at, interpolate_range(u[:, 5], -np.pi, np.pi), np.array([0.0, 1.0, 0.0])
    )
