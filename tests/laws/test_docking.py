"""A unicycle that docks, and one that cannot: the laws of Aicardi and of Brockett."""

import numpy as np
import pytest

import robsim as rs

RUNS = 50


@pytest.fixture(scope="module")
def cone():
    """Starts behind the goal, which lies at the origin and looks along x; the board
    is in view: up to 20 degrees off the axis and turned by as much from the way to the goal."""
    rng = np.random.default_rng(0)
    rho, off, turn = rng.uniform([0.1, -0.35, -0.35], [0.8, 0.35, 0.35], (RUNS, 3)).T
    return np.stack([-rho * np.cos(off), -rho * np.sin(off), off + turn], axis=1)


def polar(run):
    """rho, alpha and theta (runs, time) of the law, from q."""
    x, y, heading = np.moveaxis(run.q.values, -1, 0)
    theta = np.arctan2(-y, -x)
    alpha = (theta - heading + np.pi) % (2 * np.pi) - np.pi
    return np.hypot(x, y), alpha, theta


def test_every_start_in_the_cone_docks(arrange, cone):
    run = rs.simulate(arrange("unicycle"), rs.Docking(), cone, duration=40)
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    np.testing.assert_allclose(run.q_end, 0.0, atol=2e-5)


def test_the_distance_sinks_wherever_the_goal_lies_ahead(arrange, cone):
    """d rho/dt = -gain cos^2(alpha) rho."""
    run = rs.simulate(arrange("unicycle"), rs.Docking(), cone, dt=0.01, duration=12)
    rho, alpha, _ = polar(run)
    ahead = (np.abs(alpha) < np.pi / 2)[:, :-1]
    with np.errstate(invalid="ignore"):
        assert not (np.diff(rho, axis=1)[ahead & (rho[:, :-1] > 1e-6)] >= 0).any()
        assert (ahead | np.isnan(rho[:, :-1])).all()


@pytest.mark.parametrize(
    "what", [{}, {"gain": 0.5, "turn": 2.0, "h": 1.0}, {"turn": 6.0, "h": 4.0}]
)
def test_the_function_of_lyapunov_sinks_at_the_rate_of_theory(arrange, cone, what):
    """V = alpha^2 + h theta^2 has dV/dt = -2 turn alpha^2 (Aicardi et al. 1995): half the period,
    half the difference."""
    task, misses = rs.Docking(**what), []
    for dt in (0.01, 0.005):
        run = rs.simulate(arrange("unicycle"), task, cone, dt=dt, duration=2)
        rho, alpha, theta = polar(run)
        V, lost = alpha**2 + task.h * theta**2, 2 * task.turn * dt * alpha**2
        miss = V[:, 1:] - V[:, :1] + np.cumsum(lost, axis=1)[:, :-1]
        misses.append(np.abs(miss).max() / V.max())
        assert (V[:, -1] < 0.9 * V[:, 0]).all() and (rho[:, -1] < 0.5 * rho[:, 0]).all()
    assert misses[0] < 0.05
    assert misses[0] / misses[1] == pytest.approx(2.0, abs=0.1)


def test_the_command_agrees_with_the_published_law(arrange, cone):
    """From the true pose instead of the estimated one, for every step of every run."""
    task = rs.Docking(gain=0.8, turn=2.5, h=1.5)
    run = rs.simulate(arrange("unicycle"), task, cone, duration=3, hold=True)
    rho, alpha, theta = polar(run)
    v = 0.8 * np.cos(alpha) * rho
    omega = 2.5 * alpha + 0.8 * np.cos(alpha) * np.sinc(alpha / np.pi) * (alpha + 1.5 * theta)
    np.testing.assert_allclose(run.qd.values[..., 0], v, atol=1e-9)
    np.testing.assert_allclose(run.qd.values[..., 1], omega, atol=1e-6)


def test_a_goal_that_was_shown_elsewhere_is_docked_at(arrange, cone):
    scene, goal = arrange("unicycle"), [0.1, -0.05, 0.1]
    run = rs.simulate(scene, rs.Docking(goal=goal), cone[:10], duration=40)
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    np.testing.assert_allclose(run.q_end, np.tile(goal, (10, 1)), atol=3e-5)


def test_on_the_spot_the_unicycle_turns_and_stays(arrange):
    """There the bearing of the goal is nothing but rounding: it turns to the heading of the goal,
    and having turned it rests."""
    scene = arrange("unicycle")
    run = rs.simulate(scene, rs.Docking(), [0.0, 0.0, 0.3], duration=8, hold=True)
    assert float(np.abs(run.q[:, :2]).max()) < 1e-12
    assert (np.diff(np.abs(run.q[:, 2])) <= 0).all() and abs(float(run.q[-1, 2])) < 1e-6
    docked = rs.simulate(scene, rs.Docking(), [-0.3, 0.05, 0.0], duration=60, hold=True)
    assert float(np.abs(docked.qd[-500:]).max()) < 1e-6


def test_no_smooth_law_of_the_image_docks_a_unicycle(arrange, cone):
    """Brockett 1983: IBVS warns, and comes to rest beside the goal; few find it by chance."""
    scene = arrange("unicycle")
    with pytest.warns(rs.errors.RankWarning, match="Brockett"):
        run = rs.simulate(scene, rs.IBVS(), cone, duration=40, record="summary")
    stalled = run.outcome.values == rs.Outcome.LOCAL_MINIMUM
    assert stalled.sum() >= RUNS - 2
    beside = np.abs(run.q_end.values[:, 1])
    assert (beside[stalled] > 4e-4).all() and np.median(beside) > 0.03
