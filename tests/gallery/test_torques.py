"""Torques from the image: the numbers in the remarks of the shipped experiments."""

import numpy as np
import pytest

import robsim as rs

FLAT = "['-6, -6, 0 cm', '6, -6, 0 cm', '6, 6, 0 cm', '-6, 6, 0 cm']"


def run(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes).run()


def remaining(found, seconds):
    """The share of the first error that is left at a time."""
    norm = found.error_norm.sel(time=seconds, method="nearest")
    return float(norm / found.error_norm[0])


def test_a_lamp_creeps_to_its_goal():
    found = run("torque_planar")
    assert found.outcome == rs.Outcome.CONVERGED
    assert remaining(found, 0.25) == pytest.approx(0.126, abs=0.004)
    assert float(found.end_time) == pytest.approx(2.9, abs=0.1)


def test_a_lamp_with_little_damping_swings():
    calm, found = run("torque_planar"), run("torque_planar", "actuation.drive.damping=[1, 0.1]")
    past = [float(one.error[:, 0].max()) for one in (calm, found)]  # the lamp comes from below zero
    assert past[0] < 0.0 and past[1] > 0.03


def test_a_lamp_whose_weight_is_underestimated_hangs_below_its_goal():
    found = run("torque_planar", "actuation.drive.model.gravity=0.9")
    assert found.outcome == rs.Outcome.TIME_LIMIT
    assert float(found.pixel_error) == pytest.approx(4.3, abs=0.1)


def test_a_camera_in_the_hand_arrives():
    found = run("torque_in_hand")
    assert found.outcome == rs.Outcome.CONVERGED
    assert remaining(found, 0.25) == pytest.approx(0.22, abs=0.01)
    assert float(found.end_time) == pytest.approx(4.9, abs=0.1)
    assert float(found.distance_to_goal) < 0.004


def test_marks_in_one_plane_leave_weak_directions():
    found = run("torque_in_hand", f"objects.towers.marks={FLAT}")
    assert found.outcome == rs.Outcome.CONVERGED
    assert float(found.distance_to_goal) == pytest.approx(0.047, abs=0.002)


def test_a_long_period_takes_more_damping_than_there_is():
    """The period takes K |L J|^2 dt/2 from the damping of a joint."""
    experiment = rs.load_scenario(rs.examples.path("torque_in_hand"))
    A = np.asarray(experiment.task.task_jacobian(experiment.scene))
    taken = 0.5 * experiment.task.law.stiffness * (A**2).sum(axis=0)
    spare = np.array([30, 30, 20, 10, 10, 5]) - 0.010 * taken
    assert (spare[[3, 4]] < 0.0).all() and (spare[[0, 1, 5]] > 0.0).all()
    found = run("torque_in_hand", "run.dt=10 ms")
    assert found.outcome == rs.Outcome.TIME_LIMIT
    late = found.qd_actual.sel(time=slice(7.0, None))
    assert np.abs(late.values).max(axis=0)[4] > 1.0


def test_almost_every_visible_start_arrives():
    experiment = rs.load_scenario(rs.examples.path("torque_in_hand")).with_(record="summary")
    spread = np.radians([10, 8, 8, 20, 14, 30])
    starts = experiment.scene.home + np.random.default_rng(3).uniform(-1, 1, (100, 6)) * spread
    found = experiment.with_(start=starts, duration=20.0).run()
    seen = found.end_time.values > 0.0
    arrived = found.outcome.values[seen] == rs.Outcome.CONVERGED
    assert seen.sum() > 40 and arrived.mean() > 0.95
