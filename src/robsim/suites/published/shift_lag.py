"""Shift x lag: a target that jumps aside, seen by late images.

The camera rests at its goal. The target jumps by 0 to 10 cm, in twenty directions of space, and
turns by 4 degrees for each centimetre. This equals a run from a start beside the goal, with the
first image of the jump at time zero: the camera rests until this image arrives, and the images
before the first visible motion of the camera show the jump alone.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from robsim.geometry.pose import Pose
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.camera_poses import directions_in_cap, make_flying_scene
from robsim.suites.suite import Suite, square_marks

JUMPS = 0.0, 0.02, 0.05, 0.1  # metres
LATENCIES = 0.0, 0.1, 0.2, 0.3, 0.4  # seconds
DIRECTIONS, SEED = 20, 3
TURN = np.radians(400.0)  # for each metre


def suite() -> Suite:
    """Return the suite."""
    goal = Pose.at(0, 0, -0.6)
    cases = np.array(list(product(JUMPS, LATENCIES, range(DIRECTIONS))))
    (jump, latency), which = cases[:, :2].T, cases[:, 2].astype(int)
    u = uniform(SEED, SUITES, DIRECTIONS, 4)[which]
    shifts = jump[:, None] * directions_in_cap(u[:, :2], np.pi)
    rotations = TURN * jump[:, None] * directions_in_cap(u[:, 2:], np.pi)
    jumps = Pose.at(*shifts.T, rotvec=rotations)  # of the target, in its own axes
    return Suite(
        "shift_lag",
        1,
        "a target that jumps aside, and images that are late",
        "RobSim; the limit of a delayed loop: Corke and Good, Dynamic effects in visual "
        "closed-loop systems, IEEE Transactions on Robotics and Automation, 1996",
        "10 s after the first image of the jump, within 1 mm and 0.5 degrees",
        is_at_jumped_goal,
        make_flying_scene(500.0, square_marks(0.2)),
        goal.q,
        (jumps.inv() @ goal).q,
        gain=3.0,
        dt=0.04,
        duration=10.0,
        varied={"sensing.latency": latency},
        groups={
            "jump": [f"{100 * each:g} cm" for each in jump],
            "latency": [f"{1000 * each:g} ms" for each in latency],
        },
        draws=np.where(jump > 0, which, DIRECTIONS),  # without a jump there is no direction
        crossed=True,
    )


def is_at_jumped_goal(rows: pd.DataFrame) -> Any:
    """Return which runs rest at the new position of the target, one truth value for each row."""
    return (rows["distance_to_goal"] < 1e-3) & (rows["angle_to_goal"] < np.radians(0.5))
