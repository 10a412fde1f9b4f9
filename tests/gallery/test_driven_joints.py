"""Drives of joints: the numbers in the remarks of the shipped experiments."""

import numpy as np
import pytest

import robsim as rs

LAG = "actuation.drive=none", "actuation.lag=50 ms"
COMPUTED = "actuation.drive={ kind = 'computed_torque', frequency = 20 }"


def run(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes).run()


def farthest(found):
    """The largest distance (instants,) of a mark from its goal, in pixels."""
    pairs = found.error.values.reshape(found.sizes["time"], -1, 2)
    return np.linalg.norm(pairs, axis=2).max(axis=1)


def test_a_fast_integral_makes_the_inner_loop_oscillate():
    found = run("velocity_loop")
    assert found.outcome == rs.Outcome.TIME_LIMIT
    assert farthest(found)[0] == pytest.approx(35.7, abs=0.1)
    assert 100.0 < farthest(found)[200:].max() < 140.0
    assert (np.nanmax(found.saturation.values, axis=0) > 0.0).sum() == 5


@pytest.mark.parametrize(
    ("changes", "seconds"),
    [(LAG, 0.98), (("actuation.drive.integral_rate=10",), 1.26), ((COMPUTED,), 1.01)],
    ids=["lag", "slow integral", "computed torque"],
)
def test_joints_that_are_damped_arrive_at_the_same_gain(changes, seconds):
    found = run("velocity_loop", *changes)
    assert found.outcome == rs.Outcome.CONVERGED
    assert float(found.end_time) == pytest.approx(seconds, abs=0.05)


@pytest.mark.parametrize(("gain", "left"), [(4, 39.0), (8, 19.5), (16, 3.0)])
def test_friction_leaves_an_error_that_a_higher_gain_reduces(gain, left):
    found = run("joint_friction", f"task.gain={gain}")
    assert found.outcome == rs.Outcome.TIME_LIMIT
    assert float(found.pixel_error) == pytest.approx(left, abs=0.2)
    assert (found.qd_actual.values[-1, [0, 3]] == 0.0).all()  # the joints stick


@pytest.mark.parametrize("change", ["integral_rate=10", "model.friction=1"])
def test_an_integral_or_a_known_friction_brings_the_arm_to_its_goal(change):
    found = run("joint_friction", f"actuation.drive.{change}")
    assert found.outcome == rs.Outcome.CONVERGED
    assert float(found.end_time) == pytest.approx(2.3, abs=0.1)


@pytest.mark.parametrize(("gain", "left"), [(2, 97.2), (4, 48.2)])
def test_an_arm_sags_by_a_load_that_its_drives_do_not_know(gain, left):
    found = run("unknown_payload", f"task.gain={gain}")
    assert float(found.pixel_error) == pytest.approx(left, abs=0.2)
    heights = found.camera_pose.values[[300, -1], 2, 3]
    if gain == 2:
        assert heights[0] - heights[1] == pytest.approx(0.024, abs=0.001)


@pytest.mark.parametrize("change", ["model.payload=true", "integral_rate=5"])
def test_a_known_load_or_an_integral_returns_the_marks(change):
    found = run("unknown_payload", f"actuation.drive.{change}")
    assert float(found.pixel_error) < 0.3
