"""A target that moves on its own: the lag without feed-forward, and the remaining lag with it."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.base.arrays import move_runs_last
from robsim.kernels.estimation.inverse_depth_filter import filter_depths
from robsim.servo.single_step import SingleStepController

RATE = 0.1  # rad/s
ASIDE = {"pan_tilt": [0.1, 0.05]}  # a start with a lag that is not taken for divergence
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")


@pytest.fixture
def carousel():
    """A head in the middle of a turntable that carries one mark round it, level with its eye."""
    mark = rs.Object("dot", marks=[[1.0, 0, 0.1]], on="turntable.plate")  # 25 cm above the floor
    eye = rs.MountedCamera(
        "eye", rs.Camera([[500, 0, 400], [0, 500, 400], [0, 0, 1]]), "pan_tilt.head"
    )
    robots = [rs.robots.pan_tilt(), rs.robots.turntable()]
    return rs.Scene(robots, [mark], [eye], [rs.Motion("turntable", [RATE])])


def steady(scene, task, dt=5e-3, duration=12.0):
    """||e|| at the end of a held run."""
    return float(
        rs.simulate(scene, task, ASIDE, dt=dt, duration=duration, hold=True).error_norm[-1]
    )


@quiet
@pytest.mark.parametrize("gain", [1.0, 2.0, 5.0])
def test_the_lag_behind_a_turning_target_is_rate_over_gain(carousel, gain):
    """L desired, one point, pan only: x = omega/gain, whatever the period."""
    task = rs.IBVS(interaction="desired", gain=gain)
    for dt in (0.04, 0.01):
        run = rs.simulate(carousel, task, ASIDE, dt=dt, duration=24 / gain, hold=True)
        assert abs(float(run.error[-1, 0])) == pytest.approx(RATE / gain, rel=1e-9)
        assert float(run.qd.sel(velocity="pan_tilt.pan")[-1]) == pytest.approx(RATE, rel=1e-9)


@quiet
def test_the_lag_of_the_current_matrix_agrees_with_its_own_law(carousel):
    """Pan rate = gain x/(1 + x^2) = omega: a little more than omega/gain."""
    run = rs.simulate(carousel, rs.IBVS(), ASIDE, dt=0.01, duration=24, hold=True)
    x = abs(float(run.error[-1, 0]))
    assert x / (1 + x * x) == pytest.approx(RATE, rel=1e-6)


@quiet
@pytest.mark.parametrize("interaction", ["current", "desired", "mean"])
def test_known_motion_leaves_no_lag(carousel, interaction):
    task = rs.IBVS(interaction=interaction, feed_forward="known", gain=2.0)
    assert steady(carousel, task) < 1e-9


@quiet
def test_known_motion_takes_an_error_away_as_if_nothing_moved(carousel):
    """In axes of the turning target, the loop is the same as with a target at rest."""
    still = replace(carousel, motions=[rs.Motion("turntable", [0.0])])
    a, b = (
        rs.simulate(scene, rs.IBVS(feed_forward="known"), ASIDE, dt=0.02, duration=3, hold=True)
        for scene in (carousel, still)
    )
    np.testing.assert_allclose(a.error, b.error, atol=1e-12)


@quiet
@pytest.mark.parametrize("lag", [0.05, 0.2])
def test_estimated_motion_leaves_no_lag_once_it_is_known(carousel, lag):
    """The drift of one point at rest in the image is constant: a filter of it comes to it."""
    task = rs.IBVS(feed_forward=rs.laws.EstimatedMotion(lag), gain=2.0)
    assert steady(carousel, task) < 1e-6 * RATE


@quiet
@pytest.mark.parametrize("share", [0.5, 0.9, 1.2])
def test_a_wrong_rate_leaves_its_share_of_the_lag(carousel, share):
    """The belief is share * omega: the remaining lag is |1 - share| omega/gain."""
    belief = carousel.replacing(rs.Motion("turntable", [share * RATE]))
    task = rs.IBVS(interaction="desired", gain=2.0, feed_forward="known", belief=belief)
    run = rs.simulate(carousel, task, ASIDE, dt=0.01, duration=15, hold=True)
    # what turns to the left goes to the left in the image
    assert float(run.error[-1, 0]) == pytest.approx(-(1 - share) * RATE / 2.0, rel=1e-6)


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", ["turntable", "conveyor"])
@pytest.mark.parametrize("features", ["points", "pixels", "spherical"])
def test_feed_forward_on_other_arrangements(arrange, around, decide, name, features):
    """Beside the table the drift changes all the time. Known: below a thousandth of the lag of
    the reachable part; estimated: below a tenth."""
    scene, timing = arrange(name), {"dt": 2e-3, "duration": 5.0}
    reached = {}
    for ahead in (None, "known", "estimated"):
        task = rs.IBVS(features=features, feed_forward=ahead, gain=3.0)
        run = rs.simulate(scene, task, around(scene)[0], hold=True, **timing)
        reached[ahead] = component(decide(scene, rs.IBVS(features=features), run.q[-1]).command)
    assert reached["known"] < 1e-3 * reached[None]
    assert reached["estimated"] < 0.1 * reached[None]


def component(command):
    """||A A^+ e||: the part of the error that the joints can do something about."""
    A = command.task_jacobian[..., 0]
    return float(np.linalg.norm(A @ np.linalg.pinv(A, rcond=1e-6) @ command.error[:, 0]))


@quiet
def test_feed_forward_of_a_target_at_rest_is_zero(arrange, around):
    """A scene with a turntable that stands still, bit for bit."""
    moving = arrange("turntable")
    scene = replace(moving, motions=[rs.Motion("turntable", [0.0])])
    q0 = around(scene, 3)
    plain, known = (
        rs.simulate(scene, rs.IBVS(feed_forward=ahead), q0, duration=2) for ahead in (None, "known")
    )
    np.testing.assert_array_equal(plain.q, known.q)


@quiet
def test_a_rate_that_is_a_function_of_time_is_followed(arrange):
    """Back and forth: known feed-forward hears the rate of every instant."""
    belt = rs.Motion("conveyor", lambda seconds: [0.05 * np.cos(2 * seconds)])
    scene = replace(arrange("conveyor"), motions=[belt])
    runs = [
        rs.simulate(scene, rs.IBVS(feed_forward=ahead), dt=4e-3, duration=4, hold=True)
        for ahead in (None, "known")
    ]
    lags = [float(run.error_norm[-500:].max()) for run in runs]
    assert lags[0] > 0.02 and lags[1] < 2e-3 * lags[0]


def test_a_table_turns_at_its_own_rate_whatever_the_task_does(arrange):
    run = rs.simulate(arrange("turntable"), rs.IBVS(), dt=0.01, duration=2, hold=True)
    turned = run.q.sel(coordinate="turntable.plate").values
    np.testing.assert_allclose(turned, 0.2 * run.time, atol=1e-12)


@pytest.fixture
def passing(arrange, around):
    """A conveyor, a start beside the goal, and how a task follows what passes."""
    scene = arrange("conveyor")
    q0 = around(scene, 5)
    q0[:, -1] = 0.0

    def follow(**what):
        task = rs.IBVS(feed_forward="known", gain=3.0, **what)
        return scene, task, rs.simulate(scene, task, q0, duration=5, hold=True)

    return follow


def test_a_depth_filter_uses_the_known_motion(passing):
    """Else it takes the motion of the target for parallax."""
    scene, task, run = passing(depth=rs.laws.DepthFilter(0.35))
    plain = passing()[2]
    assert (run.outcome >= rs.Outcome.CONVERGED).all()
    np.testing.assert_allclose(run.error_norm[:, -1], plain.error_norm[:, -1], atol=1e-3)
    alone = SingleStepController(task.bind(scene), 0.04)
    sight, blocks = alone.controller.sights[0], alone.begin(run.sizes["run"])
    (p,) = (call[1] for call in alone.program.calls if call[0] is filter_depths)
    for step in range(run.sizes["time"]):
        q = move_runs_last(run.q.values[:, step], 1)
        seen = sight.project(q)
        alone.decide(blocks, step, q, {sight.key: seen.pixels}, {sight.key: seen.depth})
    Z = 1 / blocks.get(p[5], p[0], 3)[:, 2]
    np.testing.assert_allclose(Z, seen.depth, rtol=0.03)


def test_broyden_learns_the_effect_of_the_joints_and_not_the_known_motion(passing):
    run, plain = passing(interaction="broyden")[2], passing()[2]
    assert (run.error_norm[:, -1] < 2e-3).all() and (plain.error_norm[:, -1] < 2e-3).all()


def test_rates_are_as_many_as_velocities_at_every_time(arrange, around):
    rates = rs.Motion("conveyor", lambda seconds: [0.0] if seconds < 0.1 else [0.0, 0.0])
    scene = arrange("conveyor").replacing(rates)
    with pytest.raises(
        rs.errors.InputError, match=r"rates of 'conveyor': expected \(1,\), got \(2,\)"
    ):
        rs.simulate(scene, rs.IBVS(), around(scene)[0])


@pytest.mark.parametrize("task", [rs.Partitioned, rs.Docking, rs.Placing])
def test_a_law_with_gains_of_its_own_has_no_feed_forward(task):
    """e + (de/dt)/gain would be right for one gain only."""
    with pytest.raises(TypeError, match="feed_forward"):
        task(feed_forward="known")
