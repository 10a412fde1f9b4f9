"""Mounts of cameras in closed form, against OpenCV's."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

FILE = Path(__file__).parent / "hand_eye_opencv.json"
CASES = json.loads(FILE.read_text(encoding="utf-8"))["cases"]
ROUNDING = 1e-12


def pose(rows):
    """The pose of 3 x 4 matrices."""
    last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (*np.shape(rows)[:-2], 1, 4))
    return rs.Pose(np.concatenate([rows, last], axis=-2))


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"noise {case['noise']}")
@pytest.mark.parametrize("method", ["tsai_lenz", "park_martin", "daniilidis"])
def test_a_mount_agrees_with_opencv(case, method):
    """Also with noise to the last digits; of Tsai and Lenz it leaves out small motions."""
    ours = rs.calibration.solve_hand_eye(pose(case["T_m_f"]), pose(case["T_c_o"]), method)
    near = ROUNDING + (0.1 * case["noise"] if method == "tsai_lenz" else 0.0)
    np.testing.assert_allclose(ours.matrix[:3], case["mounts"][method], atol=near)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"noise {case['noise']}")
def test_mount_and_place_agree_with_opencv(case):
    """The rotations to the last digits; its positions are the best in the axes of the camera."""
    found = rs.calibration.solve_robot_world(pose(case["T_m_f"]), pose(case["T_c_o"]))
    for ours, theirs in zip(found, (case["mount"], case["place"]), strict=True):
        np.testing.assert_allclose(ours.rotation, pose(theirs).rotation, atol=ROUNDING)
        near = ROUNDING + case["noise"]
        np.testing.assert_allclose(ours.position, pose(theirs).position, atol=near)
