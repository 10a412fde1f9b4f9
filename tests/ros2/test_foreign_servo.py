"""A servo node without RobSim drives a played cell, and the bag shows the fault of the cell."""

import signal
from pathlib import Path

import numpy as np
from ros_processes import wait_until
from std_msgs.msg import Float64MultiArray

import robsim as rs

HERE = Path(__file__).parent
CELL, SERVO = HERE / "foreign_cell.toml", HERE / "foreign_servo.py"
GOAL = np.array([219.5, 139.5, 419.5, 139.5, 419.5, 339.5, 219.5, 339.5])  # columns and rows
# findings that a busy computer causes
DELAYS = {"image times", "lost images", "old images", "command delay", "drive lag"}


def test_the_servo_is_short_and_knows_nothing_of_robsim():
    text = SERVO.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    assert not any("robsim" in line for line in text.splitlines() if "import" in line)


def test_a_foreign_servo_is_driven_and_explained(robsim, start, listener, tmp_path):
    """The patient has a camera with 0.85 times the focal length; the servo node does not know."""
    marks = listener.hear(Float64MultiArray, "/eye/detections")
    bag = tmp_path / "patient.mcap"
    change = ["--set", "cameras.eye.focal=[425, 425]"]
    play = robsim("ros2", "play", CELL, *change, "--record", bag)
    servo = start(SERVO)

    def arrived():
        seen = np.array(marks[-1][1].data[2:]) if marks else np.empty(0)
        return seen.size == GOAL.size and np.abs(seen - GOAL).max() < 2.0

    wait_until(arrived, "arrival")
    assert play.finish(signal.SIGTERM) == 0
    servo.finish(signal.SIGTERM)
    causes = rs.explain(rs.logs.read_bag(bag, rs.load_scenario(CELL)), trials=False).causes
    findings = {each.about: each for each in causes}
    assert abs(findings.pop("focal length").evidence["factor"] - 0.85) < 2e-3
    assert {each for about in findings for each in about.split(" or ")} <= DELAYS
    told = robsim("explain", bag, CELL)
    told.wait_for("focal length of 'eye' is 0.85")
    assert told.finish() == 0
