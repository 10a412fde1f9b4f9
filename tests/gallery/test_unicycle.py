"""A unicycle docks from anywhere near; a law without the wheels' constraint rests on a curve."""

import numpy as np
import pytest

import robsim as rs

AHEAD = 0.14  # metres, from the unicycle to its camera


def starts():
    low, high = [-0.6, -0.15, -0.3], [-0.2, 0.15, 0.3]
    return np.random.default_rng(1).uniform(low, high, (24, 3))


def run_of(*changes):
    scenario = rs.load_scenario(rs.examples.path("unicycle_docking"), changes)
    return scenario.run(start=starts(), duration=60.0)


def test_docking_arrives_from_every_start():
    """Within the tolerance of the task, 1e-5 m and rad."""
    run = run_of()
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    assert abs(run.q_end.values).max() < 1.5e-5


@pytest.mark.parametrize("scheme", [["task.kind=pbvs", "task.form=goal"], ["task.kind=ibvs"]])
def test_no_smooth_law_of_the_pose_does(scheme):
    """Brockett 1983; here all 24 starts end askew, most of them by centimetres.

    The rests are a curve through the goal, and one start or another ends near it by chance.
    """
    with pytest.warns(rs.errors.RankWarning, match="cannot move sideways"):
        run = run_of(*scheme)
    assert (run.outcome == rs.Outcome.LOCAL_MINIMUM).all()
    aside = abs(run.q_end.values[:, 1])
    assert np.median(aside) > 0.05 and aside.max() > 0.1
    assert (abs(run.q_end.values).max(axis=1) > 1e-4).all()


def test_the_rests_of_the_position_based_law_are_a_curve():
    """Points at which no motion of the wheels reduces |c*t_c|^2 + theta^2, in metres and radians.

    With p the way of the camera from its goal: p has no part ahead (driving), and
    theta = -AHEAD times its part to the left (turning, which swings the camera sideways).
    """
    with pytest.warns(rs.errors.RankWarning):
        x, y, theta = run_of("task.kind=pbvs", "task.form=goal").q_end.values.T
    p = x + AHEAD * np.cos(theta) - AHEAD, y + AHEAD * np.sin(theta)
    ahead = p[0] * np.cos(theta) + p[1] * np.sin(theta)
    left = -p[0] * np.sin(theta) + p[1] * np.cos(theta)
    np.testing.assert_allclose(ahead, 0.0, atol=1e-6)
    np.testing.assert_allclose(theta, -AHEAD * left, atol=1e-6)
