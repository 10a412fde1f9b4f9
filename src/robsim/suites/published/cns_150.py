"""CNS-150: pairs of start and goal in three ranges of rotation and three scales of the scene.

From the paper: 150 pairs, in thirds by the angle between start and goal; scenes of three scales;
the camera, its 50 Hz, 600 steps, and the criterion of success. Chosen here: the target, a square of
20 cm, and the sampling of pairs: both cameras are within 45 degrees of the normal of the square,
0.5 to 1 m away, look at a point within 5 cm of its middle, and have any roll.
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
from robsim.suites.suite import Suite, square_marks

THIRDS = (3, 43), (45, 92), (94, 180)  # angles between start and goal, in degrees
PAIRS = 50  # pairs in each third
SCALES = 0.2, 1.0, 5.0
DRAWS = 4000  # samples, enough for each third
SIDE = 0.2  # side of the square in metres, at scale 1


def suite() -> Suite:
    """Return the suite."""
    T_goal_o, T_goal_start = _sample_pairs()
    T_w_o, T_w_c = _scale_worlds(T_goal_o), _scale_worlds(T_goal_start)
    return Suite(
        "cns_150",
        1,
        "150 pairs of start and goal, in three sizes of the world",
        'after "CNS: Correspondence Encoded Neural Image Servo Policy", arXiv 2309.09047, 2023',
        "at the end within 10 % of the initial distance and within 10 degrees of the goal",
        is_within_tenth,
        make_flying_scene(540.0, square_marks(SIDE)),
        Pose(np.eye(4)).q,
        T_w_c.q,
        gain=2.0,
        dt=0.02,
        duration=12.0,
        varied={
            "objects.square.position": T_w_o.position,
            "objects.square.rotation": T_w_o.rotation,
            "objects.square.marks": np.repeat(
                [square_marks(s * SIDE) for s in SCALES], 150, axis=0
            ),
        },
        groups={
            "rotation": [f"{low}-{high} deg" for low, high in THIRDS for _ in range(PAIRS)] * 3,
            "scale": [f"scale {scale:g}" for scale in SCALES for _ in range(3 * PAIRS)],
        },
    )


def is_within_tenth(rows: pd.DataFrame) -> Any:
    """Return which runs meet the criterion of the paper, one truth value for each row."""
    near = rows["distance_to_goal"] <= 0.1 * rows["distance_at_start"]
    return near & (rows["angle_to_goal"] <= np.radians(10.0))


def _sample_pairs() -> tuple[Pose, Pose]:
    """Return T_goal_o and T_goal_start (150,) of all pairs, third after third."""
    u = uniform(0, SUITES, DRAWS, 12)
    goal, start = _sample_cameras(u[:, :6]), _sample_cameras(u[:, 6:])
    apart = goal.inv() @ start
    turn = np.degrees(compute_rotation_angle((apart.rotation - np.eye(3)).reshape(-1, 9).T))
    inside = [np.flatnonzero((turn >= low) & (turn <= high))[:PAIRS] for low, high in THIRDS]
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


def _scale_worlds(pose: Pose) -> Pose:
    """Return the poses (150,) in worlds of all scales (450,)."""
    T = np.tile(pose.matrix, (len(SCALES), 1, 1))
    T[:, :3, 3] *= np.repeat(SCALES, 3 * PAIRS)[:, None]
    return Pose(T)
