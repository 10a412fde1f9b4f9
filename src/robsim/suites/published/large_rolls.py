"""1,000 visible starts with any roll, in a large box above the target.

A harder set than `vit_500`, with its camera, target and goal: the box of 1.6 x 1.6 x 0.7 m about
(0, 0, 0.65) m, viewed points within 25 cm of the middle of the target, and any roll. Every start
sees all marks, at least 8 pixels inside the image. Beside the textbooks' schemes, three of them run
within the constraint `FieldOfView`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.builtin_schemes import BUILT_IN, constrain_schemes
from robsim.suites.camera_poses import SIZE, interpolate_range, look_at_points, make_flying_scene
from robsim.suites.published.vit_500 import FOCAL, GOAL
from robsim.suites.suite import Suite, square_marks
from robsim.world.scene import Scene

STARTS, SAMPLES, SEED = 1000, 3000, 5
MIDDLE, HALF = np.array([0.0, 0.0, 0.65]), np.array([0.8, 0.8, 0.35])  # of the box, metres
RADIUS = 0.25  # of the viewed points, metres
MARGIN = 8.0  # pixels between a mark and the border of the image at the start
LEAST_DEPTH = 0.1  # metres


def suite() -> Suite:
    """Return the suite."""
    scene = make_flying_scene(FOCAL, square_marks(0.2))
    q = _sample_poses().q
    return Suite(
        "large_rolls",
        1,
        "1,000 visible starts with any roll",
        "RobSim; the camera, the target and the goal of vit_500",
        "at the end within 1 cm and 1 degree",
        is_at_goal,
        scene,
        GOAL.q,
        q[sees_marks(scene, q)][:STARTS],
        gain=1.0,
        dt=0.02,
        duration=60.0,
        schemes={**BUILT_IN, **constrain_schemes("in view", FieldOfView())},
    )


def is_at_goal(rows: pd.DataFrame) -> Any:
    """Return which runs rest within 1 cm and 1 degree, one truth value for each row."""
    return (rows["distance_to_goal"] < 0.01) & (rows["angle_to_goal"] < np.radians(1.0))


def sees_marks(scene: Scene, q: Array) -> NDArray[np.bool_]:
    """Return at which coordinates (N, nq) all marks are well inside the image, (N,)."""
    view = scene.view(q)
    from_border = np.minimum(view.pixels + 0.5, np.array(SIZE) - 0.5 - view.pixels)
    inside = (from_border > MARGIN).all(axis=(1, 2)) & (view.depth > LEAST_DEPTH).all(axis=1)
    return np.asarray(inside)


def _sample_poses() -> Pose:
    """Return poses (3000,) of a camera that looks near the middle of the target."""
    u = uniform(SEED, SUITES, SAMPLES, 6)
    radius, turn = RADIUS * np.sqrt(u[:, 3]), 2.0 * np.pi * u[:, 4]
    at = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn], axis=1)
    roll = interpolate_range(u[:, 5], -np.pi, np.pi)
    positions = MIDDLE + HALF * interpolate_range(u[:, :3], -1.0, 1.0)
    return look_at_points(positions, at, roll, GOAL.rotation[:, 1])
