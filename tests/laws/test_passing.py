"""A run that only passes its goal while its images are old has not converged."""

import numpy as np
import pytest

import robsim as rs


def run_of(gain_dt, *changes):
    changes = [f"task.gain={gain_dt / 0.04!r}", "run.duration=10 s", *changes]
    return rs.load_scenario(rs.examples.path("latency_and_gain"), changes).run()


def test_half_the_gain_at_two_periods_crosses_zero_exactly():
    """e = 1, 1/2, 0, and then on to -1/2: in the image of step 4 there is no error at all."""
    run = run_of(0.5)
    assert run.error_norm[4] < 1e-12
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
    assert float(run.pixel_error) < 0.01 and float(run.end_time) > 1.0


@pytest.mark.covering(2)
@pytest.mark.parametrize("late", [0, 1, 1.5, 3])
@pytest.mark.parametrize("n", [1, 4])
@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_a_converged_run_is_at_its_goal(late, n, lost):
    """A tolerance of 0.02 (10 px) makes false crossings many; within one and a half of it."""
    ends = []
    for gain_dt in np.linspace(0.04, 0.4, 10).tolist():
        run = run_of(
            gain_dt,
            f"sensing.latency={40 * late} ms",
            f"sensing.period={40 * n} ms",
            f"sensing.dropped={lost}",
            "task.tolerance=0.02",
        )
        if int(run.outcome) == rs.Outcome.CONVERGED:
            ends.append(float(run.pixel_error))
    assert len(ends) >= 3
    assert max(ends) < 1.5 * np.sqrt(2) * 500 * 0.02


@pytest.mark.parametrize("lag", [0.1, 0.5, 2.0])
def test_joints_that_still_run_have_not_converged(lag):
    """Beside the command they move the image by less than the tolerance in 1/gain."""
    for gain in (1.0, 2.0, 4.0):
        run = run_of(
            gain * 0.04,
            "sensing.latency=0 ms",
            f"actuation.lag={lag} s",
            "task.tolerance=0.02",
            "run.duration=60 s",
        )
        assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
        rates = run.qd_actual.dropna("time").values[-1]
        command = run.qd.dropna("time").values[-1]
        assert abs(rates - command)[:2].max() < 0.02 * gain * 1.01  # at a depth of a metre
