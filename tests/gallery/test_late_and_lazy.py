"""Late, rare and lost images, and joints that lag, against closed forms of the loop.

The square is parallel to the image and the camera moves sideways: depths stay, L V is linear in the
way, and the loop is an integrator with gain times dt per period, exactly.
"""

import numpy as np
import pytest

import robsim as rs

DT = 0.04  # of both scenarios
NEAR = "start.position=1, -1, -100 cm"


def scenario_of(name, gain_dt, *changes):
    return rs.load_scenario(rs.examples.path(name), [f"task.gain={gain_dt / DT!r}", *changes])


def ways(scenario, steps, runs=None):
    """x of the camera relative to the start, at each instant; first the run, if there are many."""
    starts = scenario.start if runs is None else np.tile(scenario.start, (runs, 1))
    run = scenario.run(start=starts, duration=steps * DT, hold=True)
    return run.camera_pose.values[..., 0, 3] / scenario.start[0]


def polynomial(gain_dt, periods):
    """z^(d+1) - z^d + gain dt ((1 - f) z + f): the image is of the mean of two instants."""
    d = max(int(np.ceil(periods)), 1)
    f = periods - d + 1
    return np.polyadd([1.0, -1.0] + d * [0.0], gain_dt * np.array([1 - f, f]))


def limit(periods):
    """The gain at which the largest root leaves the unit circle, by bisection."""
    low, high = 0.0, 5.0
    for _ in range(50):
        middle = (low + high) / 2
        stable = abs(np.roots(polynomial(middle, periods))).max() < 1
        low, high = (middle, high) if stable else (low, middle)
    return low


def growth(way, roots):
    """The largest of the last swings against the largest of the middle swings."""
    n = len(way)
    swing = max(int(np.ceil(2 * np.pi / max(abs(np.angle(roots)).max(), 0.1))), 2)
    return abs(way[-2 * swing :]).max() / abs(way[n // 2 : n // 2 + 2 * swing]).max()


@pytest.mark.parametrize("d", [0, 1, 2, 3])
def test_the_limit_of_the_roots_is_the_closed_form(d):
    assert limit(d) == pytest.approx(2 * np.sin(np.pi / (2 * (2 * d + 1))), rel=1e-9)


@pytest.mark.parametrize("periods", [0, 1, 2, 3, 0.25, 0.5, 0.75, 1.5, 2.5])
def test_latency_limits_the_gain(periods):
    """One percent below the limit the swings shrink, one percent above they grow."""
    at = limit(periods)
    for share, grows in ((0.99, False), (1.01, True)):
        late = f"sensing.latency={1000 * DT * periods!r} ms"
        way = ways(scenario_of("latency_and_gain", share * at, late, NEAR), 400)
        way = way[np.isfinite(way)]  # one that left the image has grown
        assert (growth(way, np.roots(polynomial(share * at, periods))) > 1) == grows


@pytest.mark.parametrize("periods", [0.25, 0.5, 1, 1.5, 2, 2.75])
def test_a_late_loop_is_its_difference_equation(periods):
    d = max(int(np.ceil(periods)), 1)
    f, gain_dt = periods - d + 1, 0.4
    late = f"sensing.latency={1000 * DT * periods!r} ms"
    way = ways(scenario_of("latency_and_gain", gain_dt, late), 40)
    e = np.ones(41 + d)  # before the start the first image is used
    for k in range(d, 40 + d):
        seen = 1.0 if k < 2 * d else f * e[k - d] + (1 - f) * e[k - d + 1]
        e[k + 1] = e[k] - gain_dt * seen
    np.testing.assert_allclose(way, e[d:], rtol=0, atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_a_camera_of_n_periods_leaves_two_nths_of_the_gain(n):
    """From image to image the error is multiplied by 1 - n gain dt."""
    for share in (0.99, 1.01):
        gain_dt = share * 2 / n
        way = ways(scenario_of("slow_camera", gain_dt, f"sensing.period={40 * n} ms", NEAR), 16 * n)
        np.testing.assert_allclose(way[::n], (1 - n * gain_dt) ** np.arange(17), atol=1e-9)


def test_a_controller_faster_than_its_camera_gains_nothing():
    slow = scenario_of("slow_camera", 0.2, "run.dt=160 ms", "sensing.period=160 ms").run()
    fast = scenario_of("slow_camera", 0.2).run()
    np.testing.assert_allclose(fast.q[::4][:10], slow.q[:10], atol=1e-9)


@pytest.mark.parametrize("lost", [0.3, 0.6])
def test_lost_images_change_mean_and_mean_square_as_predicted(lost):
    """Of (e, e seen), by the exact recursion; within four standard errors of 4,000 runs.

    At this gain a run of losses leaves e between 0 and 1, so that the errors are nearly normal.
    """
    lossy = ["sensing.period=40 ms", f"sensing.dropped={lost}"]
    way = ways(scenario_of("slow_camera", 0.1, *lossy), 8, 4000)
    arrived, kept = np.array([[0.9, 0], [1, 0]]), np.array([[1, -0.1], [0, 1]])
    mean, square = np.ones(2), np.ones((2, 2))
    for k in range(1, 9):
        share = lost if k > 1 else 0.0  # the first image arrives
        mean = (1 - share) * arrived @ mean + share * kept @ mean
        square = (1 - share) * arrived @ square @ arrived.T + share * kept @ square @ kept.T
        for sample, expected in ((way[:, k], mean[0]), (way[:, k] ** 2, square[0, 0])):
            assert abs(sample.mean() - expected) < 1e-9 + 4 * sample.std() / np.sqrt(4000)


@pytest.mark.parametrize("lost", [0.1, 0.3, 0.6])
def test_the_mean_square_settles_below_a_closed_form(lost):
    """E (1 - N gain dt)^2 = 1 for geometric N: gain dt = 2 (1 - p)/(1 + p)."""

    def radius(gain_dt):
        arrived, kept = np.array([[1 - gain_dt, 0], [1, 0]]), np.array([[1, -gain_dt], [0, 1]])
        step = (1 - lost) * np.kron(arrived, arrived) + lost * np.kron(kept, kept)
        return abs(np.linalg.eigvals(step)).max()

    at = 2 * (1 - lost) / (1 + lost)
    assert radius(0.999 * at) < 1 < radius(1.001 * at)


@pytest.mark.parametrize("gain_lag", [0.25, 1.0, 4.0])
def test_joints_that_lag_make_a_second_order_loop(gain_lag):
    """(e, v) over a period: v' = (-gain e - v) / lag with e held, in closed form."""
    gain = 0.1 / DT
    lag = gain_lag / gain
    changes = ["sensing.latency=0 ms", f"actuation.lag={lag!r} s"]
    way = ways(scenario_of("latency_and_gain", 0.1, *changes), 100)
    rest = np.exp(-DT / lag)
    late = lag * (1 - rest)
    step = np.array([[1 - gain * (DT - late), late], [-gain * (1 - rest), rest]])
    expected = [np.linalg.matrix_power(step, k)[0, 0] for k in range(101)]
    np.testing.assert_allclose(way, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("gain_lag", [1.0, 2.0])
def test_the_overshoot_of_lagging_joints(gain_lag):
    """Exp(-pi zeta / sqrt(1 - zeta^2)) with zeta = 1 / (2 sqrt(gain lag)), as dt goes to 0.

    A command held for dt is late by dt/2, which adds to the overshoot in proportion: an
    extrapolation from two dt leaves a residue of dt^2, some 1e-5.
    """
    zeta = 0.5 / np.sqrt(gain_lag)
    seen = {}
    for ms in (4, 8):
        changes = ["sensing.latency=0 ms", f"actuation.lag={gain_lag / 2} s", "task.gain=2"]
        changes += [f"run.dt={ms} ms", "run.duration=5 s", "run.hold=true"]
        way = rs.load_scenario(rs.examples.path("latency_and_gain"), changes).run().q.values[:, 0]
        seen[ms] = -way.min() / way[0]
    closed = np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2))
    assert 2 * seen[4] - seen[8] == pytest.approx(closed, abs=1e-4)
    assert 0 < seen[4] - closed < 0.01


def test_an_arm_whose_joints_lag_overshoots_alike():
    """Gain times lag is 1 (16.3 percent); dt/2 and the curvature of six joints remain."""
    run = rs.load_scenario(rs.examples.path("joint_lag"), ["run.hold=true"]).run()
    way = run.error.values @ run.error.values[0] / (run.error.values[0] @ run.error.values[0])
    assert -way.min() == pytest.approx(np.exp(-np.pi / np.sqrt(3)), abs=0.01)
    assert float(run.time[way.argmin()]) == pytest.approx(np.pi / np.sqrt(3), abs=0.02)
    calm = rs.load_scenario(rs.examples.path("joint_lag"), ["actuation.lag=125 ms"]).run()
    along = calm.error.values @ calm.error.values[0]
    assert np.nanmin(along) > -1e-6 * along[0]
