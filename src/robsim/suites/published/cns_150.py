"""CNS-150: the pairs of start and goal of the paper, in three scales of the scene.

From the paper and its code (github.com/hhcaz/CNS, MIT License): the 150 pairs of camera poses, its
thirds by the angle between start and goal, the scales, the camera, its 50 Hz, the gain, 600 steps,
and the rule of success. The paper looks at eight to eleven objects near the origin of the world and
matches points of their images. Chosen here: the target, a square of 20 cm on the floor at the
origin, whose marks are matched without errors, and the end of a run at the tolerance of its task.
"""

from __future__ import annotations

from importlib import resources
from typing import Any

import numpy as np
import pandas as pd

from robsim.geometry.pose import Pose
from robsim.run.end_variables import compute_rotation_angle
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.suites.builtin_schemes import BUILT_IN, constrain_schemes
from robsim.suites.camera_poses import make_flying_scene
from robsim.suites.suite import Suite, square_marks

THIRDS = (3, 43), (45, 92), (94, 180)  # angles between start and goal, in degrees
PAIRS = 150
SCALES = 0.2, 1.0, 5.0
FOCAL = 540.0  # pixels
SIDE = 0.2  # side of the square in metres, at scale 1


def suite() -> Suite:
    """Return the suite."""
    T_w_goal, T_w_start = _read_pairs()
    return Suite(
        "cns_150",
        2,
        "the 150 pairs of start and goal of the paper, in three sizes of the world",
        "Chen, Yu, Wang and Xiong, CNS: Correspondence Encoded Neural Image Servo Policy, "
        "arXiv 2309.09047, 2023; poses: github.com/hhcaz/CNS, MIT License",
        "at the end nearer to the goal than 10 % of its distance from the origin, and within 10 "
        "degrees",
        is_near_for_scene,
        make_flying_scene(FOCAL, square_marks(SIDE)),
        Pose(np.eye(4)).q,
        **scale_pairs(T_w_goal.inv(), T_w_goal.inv() @ T_w_start),
        schemes={
            **BUILT_IN,
            **constrain_schemes("in view", FieldOfView(), names=["PBVS, goal form"]),
        },
    )


def is_near_for_scene(rows: pd.DataFrame) -> Any:
    """Return which runs meet the rule of the paper's code, one truth value for each row."""
    near = rows["distance_to_goal"] < 0.1 * rows["goal_distance"]
    return near & (rows["angle_to_goal"] < np.radians(10.0))


def _read_pairs() -> tuple[Pose, Pose]:
    """Return T_w_goal and T_w_start (150,) of the pairs, in the order of the paper's scenes."""
    file = resources.files(__package__) / "cns_150.csv"
    rows = np.loadtxt(file.read_text(encoding="utf-8").splitlines(), delimiter=",")
    T = np.tile(np.eye(4), (2, PAIRS, 1, 1))
    T[:, :, :3] = rows.reshape(PAIRS, 2, 3, 4).swapaxes(0, 1)
    return Pose(T[0]), Pose(T[1])


def scale_pairs(T_goal_o: Pose, T_goal_start: Pose) -> dict[str, Any]:
    """Return the arguments of a suite of pairs (150,) in all scales, in axes of the goal's camera.

    The runs of a pair in all scales are one draw.
    """
    T_w_o, T_w_start = _scale_worlds(T_goal_o), _scale_worlds(T_goal_start)
    marks = [square_marks(scale * SIDE) for scale in SCALES]
    return {
        "starts": T_w_start.q,
        "gain": 2.0,
        "dt": 0.02,
        "duration": 12.0,
        "varied": {
            "objects.square.position": T_w_o.position,
            "objects.square.rotation": T_w_o.rotation,
            "objects.square.marks": np.repeat(marks, PAIRS, axis=0),
        },
        "groups": {
            "rotation": _label_thirds(T_goal_start) * len(SCALES),
            "scale": [f"scale {scale:g}" for scale in SCALES for _ in range(PAIRS)],
        },
        "draws": np.tile(np.arange(PAIRS), len(SCALES)),
        "columns": {"goal_distance": np.linalg.norm(T_w_o.position, axis=1)},
    }


def _label_thirds(T_goal_start: Pose) -> list[str]:
    """Return the label of the third of each pair, by its rank among the angles of all pairs."""
    angles = compute_rotation_angle((T_goal_start.rotation - np.eye(3)).reshape(-1, 9).T)
    ranks = np.argsort(np.argsort(angles, kind="stable"), kind="stable")
    labels = [f"{low}-{high} deg" for low, high in THIRDS]
    return [labels[len(THIRDS) * rank // PAIRS] for rank in ranks]


def _scale_worlds(pose: Pose) -> Pose:
    """Return the poses (150,) in worlds of all scales (450,)."""
    T = np.tile(pose.matrix, (len(SCALES), 1, 1))
    T[:, :3, 3] *= np.repeat(SCALES, PAIRS)[:, None]
    return Pose(T)
