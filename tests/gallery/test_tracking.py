"""A head that pans after a target on a carousel around it, against closed forms.

The angle a of the target from the optical axis obeys da/dt = rate - pan rate, whatever dt is.
"""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

GAIN = 2.0


def run_of(*changes, lag=0.0, **more):
    """The scenario from a start with the head `lag` radians behind."""
    scenario = rs.load_scenario(rs.examples.path("pan_tilt_tracking"), changes)
    start = np.array([-2.9, 0.0, lag - 2.9])
    return scenario.run(start=start, **more)


def bearing(run):
    return -np.arctan(run.s.values[:, 0])


AT_REST = {  # rate = pan rate, where x = tan(a) and L_x = 1 + x^2, 1, or their mean
    "current": lambda share: np.arcsin(2 * share) / 2,
    "desired": np.arctan,
    "mean": lambda share: np.arctan((1 - np.sqrt(1 - 2 * share**2)) / share),
}


@pytest.mark.parametrize("ms", [10, 200])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.4])
@pytest.mark.parametrize("interaction", AT_REST)
def test_the_lag_without_feed_forward(interaction, share, ms):
    """At rest, from half a degree beside: it decays by exp(-gain t cos 2a), to below 1e-4 rad."""
    expected = AT_REST[interaction](share)
    changes = [f"task.interaction={interaction}", "task.feed_forward=none", f"run.dt={ms} ms"]
    changes.append(f"motions.carousel.rates=['{share * GAIN} rad/s']")
    run = run_of(*changes, lag=expected + 0.01, duration=6.0)
    assert bearing(run)[-1] == pytest.approx(expected, abs=1e-4)


def test_under_l_current_there_is_no_rest_beyond_half_the_gain():
    for interaction, end in (("current", "OUT_OF_IMAGE"), ("desired", "TIME_LIMIT")):
        changes = [f"task.interaction={interaction}", "task.feed_forward=none"]
        changes.append(f"motions.carousel.rates=['{0.55 * GAIN} rad/s']")
        run = run_of(*changes, lag=0.5, duration=5.0)
        assert rs.Outcome(int(run.outcome)).name == end


@pytest.mark.parametrize("interaction", ["current", "desired"])
def test_a_known_rate_leaves_no_lag(interaction):
    run = run_of(f"task.interaction={interaction}", duration=6.0)
    assert abs(bearing(run)).max() < 1e-12


def test_an_estimated_rate_leaves_no_lag_in_the_end():
    """It is of first order: the share exp(-gain t) of the initial unknown is left."""
    lag = bearing(run_of("task.feed_forward=estimated", duration=6.0))
    assert 0.05 < lag.max() < np.arctan(np.pi / 4 / GAIN)
    assert abs(lag[-1]) < 1e-5


@pytest.mark.parametrize("seconds", [0.1, 0.3])
def test_of_an_estimated_rate_that_grows_its_delay_is_left(seconds):
    """(lag + dt) acceleration / gain: the estimate is so old; known, nothing is left.

    To first order in the angle, which is 0.01 rad at most: within 1 part in 1,000.
    """
    acceleration, dt = 0.1, 0.02
    told = rs.load_scenario(rs.examples.path("pan_tilt_tracking"))
    motion = rs.Motion("carousel", lambda t: [acceleration * t])
    scene = replace(told.scene, motions=[motion])
    left = {
        "known": 0.0,
        rs.laws.EstimatedMotion(lag=seconds): acceleration * (seconds + dt) / GAIN,
    }
    for feed_forward, expected in left.items():
        task = replace(told.task, feed_forward=feed_forward)
        run = rs.simulate(scene, task, told.start, dt=dt, duration=6.5, hold=True)
        assert bearing(run)[-1] == pytest.approx(expected, rel=1e-3, abs=1e-9)
