"""Calibration: a goal that is computed with wrong camera parameters, and poor images.

Each kind of error has the same fifty starts. Errors are uniform between the limits in the name of
the group. The controller computes its goal, 60 cm in front of the target, from its beliefs. The
suite has schemes with robust weights beside the textbook schemes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.builtin_schemes import BUILT_IN
from robsim.suites.camera_poses import (
    SIZE,
    directions_in_cap,
    interpolate_range,
    look_at_points,
    make_flying_scene,
)
from robsim.suites.suite import Suite, square_marks

STARTS, SEED, FOCAL = 50, 7, 500.0
KINDS = {
    "none": "exact",
    "focal": "focal length, 5 %",
    "centre": "image centre, 10 px",
    "hand_eye": "hand-eye, 1 cm, 2 deg",
    "depth": "depths in L, 20 %",
    "noise": "noise, 1 px",
    "outliers": "5 % outliers of 30 px",
    "all": "all together",
    "image": "1 px and outliers",
}
IMAGE_ERRORS = "noise", "outliers"  # errors of the image alone
ROBUST = {
    f"{name}, {each}": replace(BUILT_IN[of], weighting=each.lower())
    for name, of, kinds in (
        ("IBVS", "IBVS, L current", ("Huber", "Tukey", "Cauchy")),
        ("PBVS", "PBVS, goal form", ("Tukey",)),
        ("2 1/2 D", "2 1/2 D", ("Tukey",)),
    )
    for each in kinds
}


def suite() -> Suite:
    """Return the suite."""
    runs = len(KINDS) * STARTS
    return Suite(
        "calibration",
        2,
        "wrong calibrations and poor images, with a computed goal",
        "RobSim; shown and computed goals: Chaumette and Hutchinson, Visual servo control, "
        "part II, IEEE Robotics and Automation Magazine, 2007",
        "at the end within 1 cm and 1 degree",
        is_near_goal,
        make_flying_scene(FOCAL, square_marks(0.2)),
        Pose.at(0, 0, -0.6).q,
        np.tile(_sample_camera_starts().q, (len(KINDS), 1)),
        gain=1.0,
        dt=0.04,
        duration=15.0,
        varied=_sample_calibration_errors(uniform(SEED + 1, SUITES, runs, 10)),
        groups={"error": [text for text in KINDS.values() for _ in range(STARTS)]},
        draws=np.tile(np.arange(STARTS), len(KINDS)),
        computed=True,
        seed=SEED,
        schemes={**BUILT_IN, **ROBUST},
    )


def is_near_goal(rows: pd.DataFrame) -> Any:
    """Return which runs end near the goal, one truth value for each row."""
    return (rows["distance_to_goal"] < 0.01) & (rows["angle_to_goal"] < np.radians(1.0))


def _sample_camera_starts() -> Pose:
    """Return the poses (50,) of the camera at the start."""
    u = uniform(SEED, SUITES, STARTS, 4)
    positions = directions_in_cap(u[:, :2], np.radians(30.0)) * interpolate_range(
        u[:, 2:3], 0.6, 0.9
    )
    roll = interpolate_range(u[:, 3], -np.radians(45.0), np.radians(45.0))
    return look_at_points(positions, np.zeros((STARTS, 3)), roll, np.array([0.0, 1.0, 0.0]))


def _sample_calibration_errors(u: Array) -> dict[str, Array]:
    """Return the values that differ from run to run, from numbers u (runs, 10) in 0..1."""
    even = interpolate_range(u, -1.0, 1.0)
    middle = (np.array(SIZE) - 1) / 2
    tilt = np.radians(2.0) * even[:, 6:9]
    return {
        "belief.cameras.eye.focal": FOCAL * (1 + 0.05 * _zero_other_kinds(even[:, 0], "focal")),
        "belief.cameras.eye.center": middle + 10.0 * _zero_other_kinds(even[:, 1:3], "centre"),
        "belief.cameras.eye.position": 0.01 * _zero_other_kinds(even[:, 3:6], "hand_eye"),
        "belief.cameras.eye.rpy": _zero_other_kinds(tilt, "hand_eye"),
        "task.depth_scale": 1 + 0.2 * _zero_other_kinds(even[:, 9], "depth"),
        "sensing.noise": _zero_other_kinds(np.ones(len(u)), "noise"),
        "sensing.outliers": 0.05 * _zero_other_kinds(np.ones(len(u)), "outliers"),
        "sensing.outlier_size": 30.0 * _zero_other_kinds(np.ones(len(u)), "outliers"),
    }


def _zero_other_kinds(values: Array, kind: str) -> Array:
    """Return values (runs, ...) that are zero in the runs of other kinds."""
    has = np.repeat([_has_error(each, kind) for each in KINDS], STARTS)
    return np.where(has.reshape(-1, *[1] * (values.ndim - 1)), values, 0.0)


def _has_error(each: str, kind: str) -> bool:
    """Return whether the runs of a group have an error of a kind."""
    return each in (kind, "all") or (each == "image" and kind in IMAGE_ERRORS)
