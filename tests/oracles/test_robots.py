"""Forward kinematics and Jacobians of DH arms against Pinocchio (pinocchio_dh.json)."""

import json
from pathlib import Path

import numpy as np
import pytest

from robsim.robot import Robot

ROBOTS = json.loads((Path(__file__).parent / "pinocchio_dh.json").read_text())["robots"]


@pytest.mark.parametrize("spec", ROBOTS, ids=lambda spec: spec["name"])
def test_poses_and_jacobians_agree_with_pinocchio(spec):
    robot = Robot.from_dh(spec["rows"], spec["convention"], spec["joints"])
    q = np.array([case["q"] for case in spec["cases"]])
    middle = f"link{spec['middle_link']}"
    for ours, key in [
        (robot.frames(q)[:, 1:], "poses"),
        (robot.jacobian(q), "jacobian_last"),
        (robot.jacobian(q, middle), "jacobian_middle"),
    ]:
        expected = np.array([case[key] for case in spec["cases"]])
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12)
