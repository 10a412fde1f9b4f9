"""Gallery: two traps of image-based servoing, and all its rest points."""

import numpy as np
import pytest

import robsim as rs
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import move_runs_last

TRAPS = ("local_minimum", "tilted_square")


def scenario_of(name, interaction="current"):
    return rs.load_scenario(rs.examples.path(name), [f"task.interaction={interaction}"])


def end_of(name, interaction="current"):
    scenario = scenario_of(name, interaction)
    run = scenario.run()
    q = scenario.task.goal.q
    T = rs.Pose(run.camera_pose.dropna("time", how="all").values[-1])
    return run, rs.Pose.from_quaternion(q[:3], q[3:]).inv() @ T


@pytest.mark.parametrize(
    ("name", "norm", "pixels", "metres", "degrees"),
    [("local_minimum", 0.00231, 1.34, 0.549, 31.7), ("tilted_square", 0.02755, 16.3, 1.397, 86.5)],
)
def test_a_small_error_far_from_the_goal(name, norm, pixels, metres, degrees):
    """The norms were computed before with plain NumPy; tolerances are a last digit each."""
    run, away = end_of(name)
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.LOCAL_MINIMUM
    assert float(run.error_norm.dropna("time")[-1]) == pytest.approx(norm, abs=1e-5)
    assert float(run.pixel_error) == pytest.approx(pixels, rel=5e-3)
    assert np.linalg.norm(away.position) == pytest.approx(metres, abs=1e-3)
    assert np.degrees(np.linalg.norm(away.rotvec)) == pytest.approx(degrees, abs=0.1)


@pytest.mark.parametrize("name", TRAPS)
@pytest.mark.parametrize("interaction", ["desired", "mean"])
def test_with_another_interaction_matrix_the_camera_arrives(name, interaction):
    run, away = end_of(name, interaction)
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
    assert float(run.pixel_error) < 0.02  # of a tolerance of 1e-5 at 1000 px
    assert np.linalg.norm(away.position) < 2e-3


def test_under_l_mean_the_camera_swings_round_the_square_at_one_distance():
    run, _ = end_of("tilted_square", "mean")
    metres = np.linalg.norm(run.camera_pose.dropna("time", how="all").values[:, :3, 3], axis=1)
    np.testing.assert_allclose(metres, 1.0, atol=1e-3)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "trapped", "lost"), [("local_minimum", 0.35, 0.21), ("tilted_square", 0.157, 0.235)]
)
def test_how_many_starts_are_trapped_under_l_current_and_lost_under_l_desired(name, trapped, lost):
    """Shares of 4000 starts; 600 others agree within three binomial standard deviations."""

    def within(share):
        return pytest.approx(share, abs=3 * np.sqrt(share * (1 - share) / 600))

    found = {}
    for interaction in ("current", "desired", "mean"):
        scenario = scenario_of(name, interaction)
        found[interaction] = rs.equilibria(scenario.scene, scenario.task, count=600, seed=1)
    assert found["current"].minima[0].share == within(trapped) and found["current"].lost < 0.01
    assert found["desired"].lost == within(lost) and not found["desired"].minima
    assert found["mean"].goal.share > 0.99 and not found["mean"].minima


@pytest.mark.parametrize("name", TRAPS)
def test_the_saddle_stands_on_the_border_between_goal_and_trap(name):
    """A millimetre or milliradian to one side runs end at the goal, to the other in the trap."""
    scenario = scenario_of(name)
    found = rs.equilibria(scenario.scene, scenario.task)
    (saddle,) = found.saddles
    field = VectorField.of(scenario.scene, scenario.task)
    q = move_runs_last(saddle.q[None], 1)
    values, vectors = np.linalg.eig(field.jacobian(q)[..., 0])
    way = 1e-3 * vectors[:, values.real.argmax()].real
    sides = field.displace(np.repeat(q, 2, axis=1), np.stack([way, -way], axis=1)).T
    ends = rs.equilibria(scenario.scene, scenario.task, sides)
    assert sorted(ends[i].kind for i in ends.ends) == ["goal", "minimum"]
