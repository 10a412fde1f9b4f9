"""Samples: moments of distributions, positions of starts, and independence of other settings."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import qmc

import robsim as rs
from robsim.starts.start_kinematics import StartKinematics
from robsim.statistics.random_numbers import RandomNumbers
from robsim.units import deg

MANY = np.arange(100_000)


def sample(sampler, count=MANY, shape=()):
    return sampler.sample_values(RandomNumbers(3, "x", count), shape)


@pytest.mark.parametrize(
    ("sampler", "mean", "std"),
    [
        (rs.samplers.Uniform(2.0, 5.0), 3.5, 3.0 / np.sqrt(12)),
        (rs.samplers.Normal(1.0, 0.2), 1.0, 0.2),
        # of log-uniform numbers from a to b: (b - a) / l and (b^2 - a^2) / 2 l, l = log(b / a)
        (
            rs.samplers.LogUniform(0.1, 10.0),
            9.9 / np.log(100),
            np.sqrt(99.99 / (2 * np.log(100)) - (9.9 / np.log(100)) ** 2),
        ),
        (rs.samplers.Sobol(-1.0, 1.0), 0.0, 2.0 / np.sqrt(12)),
    ],
)
def test_numbers_have_the_mean_and_spread_of_their_distribution(sampler, mean, std):
    source = RandomNumbers(3, "x", MANY)
    values = sampler.sample_values(source, ())
    assert abs(values.mean() - mean) < 4 * std / np.sqrt(MANY.size)
    assert abs(values.std() - std) < 0.01 * std


def test_evenly_drawn_numbers_miss_no_cell():
    points = rs.samplers.Sobol([0, 0], [1, 1]).sample_values(
        RandomNumbers(1, "x", np.arange(256)), (2,)
    )
    cells = np.floor(points * 16).astype(int)
    assert len({tuple(each) for each in cells}) == 256  # a net: one point in each of 16 x 16
    two = rs.samplers.Sobol(0, 1).sample_values(
        RandomNumbers(1, "y", np.array([5, 200]), dimension=1), ()
    )
    np.testing.assert_array_equal(two, points[[5, 200], 1])


def test_sobol_points_agree_with_scipys_sequence_up_to_their_scrambling():
    """A scrambling maps intervals of 2^-k onto each other: pairs of points share as many digits."""
    points = RandomNumbers(5, "x", np.arange(64)).sample_sobol_points(4)
    plain = qmc.Sobol(4, scramble=False).random(64)
    for k in range(1, 7):
        own, other = (np.floor(each * 2**k)[:, None] for each in (points, plain))
        same = [each == np.swapaxes(each, 0, 1) for each in (own, other)]
        np.testing.assert_array_equal(*same)
    correlations = np.corrcoef(RandomNumbers(5, "x", MANY).sample_sobol_points(4).T)
    np.testing.assert_allclose(correlations, np.eye(4), atol=1e-3)


def test_a_sobol_axis_keeps_its_points_when_another_is_added_after_it():
    """Before, the points of the first axis changed with the number of Sobol axes."""
    one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.04)
    axes = {
        "task.gain": rs.samplers.Sobol(1.0, 2.0),
        "cameras.camera.center": rs.samplers.Sum(rs.samplers.Sobol([-5.0, -5], [5.0, 5])),
        "sensing.latency": rs.samplers.Uniform(0.0, 0.04),
        "objects.square.position": rs.samplers.Sobol([-0.01] * 3, [0.01] * 3),
        "task.depth_scale": rs.samplers.Product(rs.samplers.Sobol(0.9, 1.1)),
    }
    tables = [
        rs.study(one, 16, seed=4, vary=dict(list(axes.items())[:count])).table
        for count in range(1, 6)
    ]
    for few, more in pairwise(tables):
        names = [name for name in few if name.startswith(tuple(axes))]
        assert names
        np.testing.assert_array_equal(few[names], more[names])
    every = [name for name in tables[-1] if name.startswith(tuple(axes)) and "latency" not in name]
    ranks = tables[-1][every].rank().to_numpy()  # each number has one point in each sixteenth
    assert ranks.shape == (16, 7) and (np.arange(1, 17) == np.sort(ranks, axis=0).T).all()
    assert len({tuple(column) for column in ranks.T}) == 7


def test_a_sample_depends_on_seed_name_and_number_alone():
    some = np.array([7, 3, 40])
    whole = sample(rs.samplers.Normal(0, [1.0, 2.0]), shape=(2,))
    np.testing.assert_array_equal(
        sample(rs.samplers.Normal(0, [1.0, 2.0]), some, (2,)), whole[some]
    )
    for other in (
        RandomNumbers(4, "x", MANY),
        RandomNumbers(3, "y", MANY),
        RandomNumbers(3, "x", MANY, 1),
    ):
        r = np.corrcoef(other.uniform(1)[:, 0], RandomNumbers(3, "x", MANY).uniform(1)[:, 0])[0, 1]
        assert abs(r) < 0.02


def test_choices_are_drawn_as_often():
    found = np.bincount(
        rs.samplers.Choice(["a", "b", "c"]).sample_indices(RandomNumbers(3, "x", MANY))
    )
    assert (abs(found - MANY.size / 3) < 4 * np.sqrt(MANY.size * 2 / 9)).all()


def test_a_grid_is_taken_in_turn():
    assert rs.samplers.Grid(1.0, 100.0, 3, log=True).values == pytest.approx((1.0, 10.0, 100.0))


@pytest.fixture(scope="module")
def reach(flying):
    return StartKinematics(
        flying.at("task.goal", rs.GoalPose(rs.Pose.at(0, 0, 0.5))).loop().controller
    )


def places(start, reach, count=2000):
    q, ok = start.coordinates(reach, RandomNumbers(1, "start", np.arange(count)))
    assert ok.all()
    return rs.Pose.from_quaternion(q[:, :3], q[:, 3:])


def test_the_goal_is_where_the_frame_would_be(reach):
    np.testing.assert_allclose(reach.goal.position, [0, 0, 0.5], atol=1e-12)
    np.testing.assert_allclose(reach.middle("square"), [0, 0, 1], atol=1e-12)


def test_look_at_looks_at_the_middle_of_the_marks(reach):
    start = rs.starts.LookAt("square", distance=(0.3, 0.8), roll=(-30, 60) * deg, cone=40 * deg)
    T = places(start, reach)
    to = np.array([0, 0, 1.0]) - T.position
    far = np.linalg.norm(to, axis=1)
    assert 0.3 <= far.min() < 0.31 and 0.79 < far.max() <= 0.8
    np.testing.assert_allclose(to / far[:, None], T.rotation[:, :, 2], atol=1e-12)
    away = np.degrees(np.arccos(to[:, 2] / far))
    assert 39 < away.max() <= 40 + 1e-9
    share = (away < 20).mean()  # on the sphere: (1 - cos 20) / (1 - cos 40)
    assert abs(share - (1 - np.cos(20 * deg)) / (1 - np.cos(40 * deg))) < 0.03


def test_aside_looks_past_the_middle_by_no_more(reach):
    T = places(rs.starts.LookAt("square", distance=(1, 1), cone=0.0, aside=0.1), reach)
    off = np.linalg.norm(np.cross([0, 0, 1.0] - T.position, T.rotation[:, :, 2]), axis=1)
    assert 0.09 < off.max() <= 0.1 + 1e-12


def test_a_shell_is_even_in_volume_and_in_all_directions(reach):
    T = places(rs.starts.Shell(distance=(0.1, 0.2), angle=(0.2, 0.4)), reach, 20_000)
    off = T.position - [0, 0, 0.5]
    far = np.linalg.norm(off, axis=1)
    inner = (far < 0.15).mean()
    assert abs(inner - (0.15**3 - 0.1**3) / (0.2**3 - 0.1**3)) < 0.012
    assert np.abs((off / far[:, None]).mean(axis=0)).max() < 0.02
    turn = np.linalg.norm(T.rotvec, axis=1)
    assert turn.min() >= 0.2 - 1e-9 and turn.max() <= 0.4 + 1e-9


def test_about_and_within_stay_within(reach):
    T = places(rs.starts.Within(0.3, 0.5, about=rs.Pose.at(1, 2, 3)), reach)
    assert np.linalg.norm(T.position - [1, 2, 3], axis=1).max() <= 0.3
    box = places(rs.starts.About(position=[0.1, 0.2, 0.0], rpy=[0, 0, 0.5]), reach)
    np.testing.assert_allclose(box.position[:, 2], 0.5, atol=1e-12)
    assert 0.19 < np.abs(box.position[:, 1]).max() <= 0.2
    assert 0.49 < np.linalg.norm(box.rotvec, axis=1).max() <= 0.5 + 1e-12


def test_starts_of_an_arm_are_reached_by_its_joints():
    arm = rs.load_scenario(rs.examples.path("eye_in_hand"))
    at = StartKinematics(arm.loop().controller)
    draws = RandomNumbers(1, "start", np.arange(40))
    wanted = rs.starts.Shell(distance=(0.02, 0.05), angle=(0.0, 0.2))
    q, ok = wanted.coordinates(at, draws)
    assert ok.sum() > 30
    eye = at.scene.camera().name
    for i in np.flatnonzero(ok)[:5]:
        found = at.scene.pose(eye, q[i])
        asked = wanted.poses(at, draws.uniform(6))[i]
        np.testing.assert_allclose(found.matrix, asked, atol=1e-7)


def test_anywhere_is_within_the_limits():
    arm = rs.load_scenario(rs.examples.path("eye_in_hand"))
    at = StartKinematics(arm.loop().controller)
    q, _ = rs.starts.Anywhere().coordinates(at, RandomNumbers(1, "start", np.arange(1000)))
    low, high = arm.scene.limits.T
    assert (q >= low).all() and (q <= high).all()
    assert (np.ptp(q, axis=0) > 0.98 * (high - low)).all()


def test_given_values_come_in_turn_and_together():
    """Rows of two names belong together, whichever runs are looked at, and from a text too."""
    rows = np.arange(6.0).reshape(3, 2)
    np.testing.assert_array_equal(
        sample(rs.samplers.TabulatedValues(rows), np.array([2, 0]), (2,)), rows[[2, 0]]
    )
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.04)
    vary = {
        "task.gain": rs.samplers.TabulatedValues([1, 2, 3]),
        "sensing.noise": rs.samplers.Product(rs.samplers.TabulatedValues([5, 6, 7])),
    }
    study = rs.study(experiment.at("sensing.noise", 0.5), 3, vary=vary)
    assert study.table["task.gain"].tolist() == [1, 2, 3]
    assert study.table["sensing.noise"].tolist() == [2.5, 3.0, 3.5]
    again = rs.study(rs.Experiment.from_text(study.text))
    assert again.hash == study.hash and again.table["task.gain"].tolist() == [1, 2, 3]
