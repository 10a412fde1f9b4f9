"""Robust weights: marks that lie, in the command and in poses."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.suites.camera_poses import make_flying_scene
from robsim.suites.suite import square_marks

KINDS = "huber", "tukey", "cauchy"
FOCAL, GOAL = 500.0, rs.GoalPose(rs.Pose.at(0, 0, 0.6))
SCENE = make_flying_scene(FOCAL, square_marks(0.2))
BESIDE = rs.Pose.at(0.02, -0.01, -0.62, rpy=(0.02, 0.01, -0.03)).q
CAMERA = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
CLOUD = np.random.default_rng(8).normal(scale=0.1, size=(9, 3))


def by_hand(kind, r, noise=1.0):
    """The weights of distances r (N,) in pixels."""
    u = r / max(noise, 1.482602218505602 * np.median(r))
    found = {
        "huber": np.minimum(1.0, 1.345 / np.maximum(u, 1e-9)),
        "tukey": np.where(u < 4.685, (1 - (u / 4.685) ** 2) ** 2, 0.0),
        "cauchy": 1 / (1 + (u / 2.385) ** 2),
    }
    return np.maximum(found[kind], 1e-3)


# the command


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_the_command_agrees_with_numpys_weighted_least_squares(kind, seed):
    """Of one image with outliers; its pixels and L come from the run."""
    lying = rs.Sensing(noise=1.0, outliers=0.3, outlier_size=60.0)
    task = rs.IBVS(GOAL, features="pixels", gain=0.7)
    weighted = rs.IBVS(GOAL, features="pixels", gain=0.7, weighting=kind)
    plain, run = (
        rs.simulate(SCENE, each, BESIDE, dt=0.02, duration=0.02, sensing=lying, seed=seed).isel(
            time=0
        )
        for each in (task, weighted)
    )
    w = np.repeat(by_hand(kind, np.linalg.norm(plain.error.values.reshape(4, 2), axis=1)), 2)
    np.testing.assert_allclose(run.weight, w, rtol=1e-9)
    np.testing.assert_array_equal(run.error, plain.error)
    L = interaction_of(plain)
    V = -0.7 * np.linalg.lstsq(w[:, None] * L, w * plain.error.values, rcond=None)[0]
    np.testing.assert_allclose(run.camera_velocity, V, rtol=1e-7, atol=1e-9)


WIDE = rs.Camera(
    [[500, 2, 320], [0, 480, 240], [0, 0, 1]], (640, 480), distortion=(-0.2, 0.05, 1e-3, -5e-4)
)


@pytest.mark.parametrize("camera", [SCENE.camera().camera, WIDE], ids=["plain", "wide"])
@pytest.mark.parametrize("features", ["points", "pixels"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_goal_of_image_points_has_the_weights_of_its_pose(camera, features, kind):
    """`GoalFeatures` was refused; its image points are those of the pose at the goal."""
    scene = SCENE.replacing(replace(SCENE.camera(), camera=camera))
    how = {"features": features, "gain": 0.7, "weighting": kind}
    sensing = rs.Sensing(noise=1.0, outliers=0.3, outlier_size=60.0)
    settings = {"dt": 0.02, "duration": 0.4, "sensing": sensing, "seed": 2}
    posed = rs.simulate(scene, rs.IBVS(GOAL, **how), BESIDE, **settings)
    numbers = rs.GoalFeatures(posed.s_goal.values)
    given = rs.simulate(scene, rs.IBVS(numbers, **how), BESIDE, **settings)
    assert (posed.weight.min() < 0.5).item()
    np.testing.assert_allclose(given.weight, posed.weight, atol=1e-9)
    np.testing.assert_allclose(given.q, posed.q, atol=1e-9)
    assert np.isnan(given.pixels_goal).all()  # no camera has seen it


def test_a_goal_of_pixels_follows_the_believed_camera_of_each_run():
    task = rs.IBVS(rs.GoalFeatures([220, 140, 420, 140, 420, 340, 220, 340.0]), features="pixels")
    one = rs.Experiment(SCENE, replace(task, weighting="tukey"), BESIDE, dt=0.04, duration=0.4)
    one = one.with_(sensing=rs.Sensing(outliers=0.4))
    focal = np.array([450.0, 520.0])
    both = one.vary({"belief.cameras.eye.focal": focal}).run()
    for i in range(2):
        own = one.at("belief.cameras.eye.focal", focal[i]).with_(first_run=i).run()
        np.testing.assert_array_equal(both.q[i], own.q)


def test_blocks_of_image_points_determine_the_goal_together():
    """Two marks in pixels and two as points: the same weights as all in pixels."""
    pixels = np.array([[220, 140], [420, 140], [420, 340], [220, 340.0]])
    points = (pixels - [319.5, 239.5]) / FOCAL
    block = rs.features.FeatureBlock
    blocks = [block("pixels", marks=[0, 3]), block("points", marks=[2, 1])]
    s = np.concatenate([pixels[[0, 3]].ravel(), points[[2, 1]].ravel()])
    scene = SCENE
    whole = rs.IBVS(rs.GoalFeatures(pixels.ravel()), features="pixels", weighting="huber")
    parts = rs.IBVS(rs.GoalFeatures(s), features=blocks, weighting="huber")
    lying = rs.Sensing(outliers=0.5, outlier_size=200.0)
    how = {"dt": 0.04, "duration": 0.04, "sensing": lying, "seed": 3}
    a, b = (rs.simulate(scene, each, BESIDE, **how).isel(time=0) for each in (whole, parts))
    weights = a.weight.values.reshape(4, 2)
    assert weights.min() < 0.9
    np.testing.assert_allclose(b.weight.values.reshape(4, 2), weights[[0, 3, 2, 1]], rtol=1e-12)


LINES = rs.IBVS(rs.GoalFeatures(np.zeros(4)), features="lines", weighting="huber")
UNKNOWN = {
    "lines": (LINES, "Huber needs the image .* for mark 0 of 'square'"),
    "one mark": (
        rs.IBVS(
            rs.GoalFeatures(np.zeros(6)),
            features=rs.features.FeatureBlock("pixels", marks=[0, 1, 3]),
            weighting="tukey",
        ),
        "for mark 2 of 'square'",
    ),
    "one number": (
        rs.IBVS(
            rs.GoalFeatures(np.zeros(3)),
            features=rs.features.FeatureBlock("points", components=[0, 1, 2]),
            weighting="cauchy",
        ),
        "for mark 0 of 'square'",
    ),
    "too few": (
        rs.IBVS(rs.GoalFeatures(np.zeros(6)), weighting="cauchy"),
        "goal s: expected 8 numbers",
    ),
}


@pytest.mark.parametrize("case", UNKNOWN)
def test_a_goal_of_other_numbers_has_no_image(case):
    task, words = UNKNOWN[case]
    with pytest.raises(rs.errors.InputError, match=words) as error:
        rs.simulate(SCENE, task, BESIDE, duration=0.1)
    assert "\n" not in str(error.value)


def interaction_of(run):
    """L (8, 6) in pixels of the measurement of a run at an instant, at the true depths."""
    points = (run.s.values.reshape(4, 2) - [319.5, 239.5]) / FOCAL
    T = rs.Pose(run.camera_pose.values).inv().matrix
    x, y, i = points[:, 0], points[:, 1], 1 / (square_marks(0.2) @ T[:3, :3].T + T[:3, 3])[:, 2]
    o = 0 * i
    rows = [[-i, o, x * i, x * y, -(1 + x * x), y], [o, -i, y * i, 1 + y * y, -x * y, -x]]
    return FOCAL * np.moveaxis(np.array(rows), -1, 0).reshape(-1, 6)


class Place:
    """The position of the target in the camera, of the pose that is seen, in Python."""

    unit, tolerance, least_marks, uses_pose = "m", 1e-5, 3, True

    def measure(self, seen):
        return seen.pose[:, :3, 3]


@pytest.mark.filterwarnings("ignore:the features of")  # three of six motions
def test_the_pose_that_a_users_feature_sees_has_the_weights_too():
    lying = rs.Sensing(noise=1.0, outliers=0.2, outlier_size=40.0)
    own, ours, plain = (
        rs.simulate(SCENE, task, starts(8), duration=0.04, sensing=lying, seed=3).s
        for task in (
            rs.IBVS(GOAL, features=Place(), weighting="tukey"),
            rs.IBVS(GOAL, features=rs.features.Translation("camera"), weighting="tukey"),
            rs.IBVS(GOAL, features=rs.features.Translation("camera")),
        )
    )
    np.testing.assert_allclose(own[:, 0], ours[:, 0], atol=1e-12)
    assert np.abs(own[:, 0] - plain[:, 0]).max() > 1e-3


def starts(runs):
    """So many starts (runs, 7), a little apart."""
    return BESIDE + np.linspace(0, 0.03, runs)[:, None] * np.eye(7)[0]


@pytest.mark.parametrize("task", [rs.IBVS(GOAL), rs.PBVS(GOAL), rs.Hybrid(GOAL)])
@pytest.mark.parametrize("kind", KINDS)
def test_where_no_mark_lies_a_run_ends_as_without_weights(task, kind):
    ends = [
        rs.simulate(SCENE, each, BESIDE, duration=15)
        for each in (task, replace(task, weighting=kind))
    ]
    assert all(run.outcome == rs.Outcome.CONVERGED for run in ends)
    np.testing.assert_allclose(ends[1].q_end, ends[0].q_end, atol=1e-4)


def test_a_mark_beside_its_place_does_not_move_the_end():
    """One of 16 marks is seen 20 px aside all the time; the camera arrives without it."""
    grid = np.array(
        [[x, y, 0.0] for x in np.linspace(-0.1, 0.1, 4) for y in np.linspace(-0.1, 0.1, 4)]
    )
    moved = grid.copy()
    moved[5] += [0.024, 0, 0]  # 20 px at 0.6 m
    scene = make_flying_scene(FOCAL, moved)
    belief = scene.believe(marks=grid)
    away = {}
    for kind in (None, "tukey"):
        how = {} if kind is None else {"weighting": kind}
        run = rs.simulate(scene, rs.IBVS(GOAL, belief=belief, **how), BESIDE, duration=12)
        away[kind] = np.linalg.norm(run.q_end.values[:3] - [0, 0, -0.6])
    assert away[None] > 1.5e-3
    assert away["tukey"] < 0.05 * away[None]


@pytest.mark.parametrize("how", [dict(threads=1, chunk=1), dict(threads=2, chunk=3)])
def test_threads_and_chunks_change_no_bit(how):
    lying = rs.Sensing(noise=1.0, outliers=0.2, outlier_size=30.0)
    for task in (rs.IBVS(GOAL, weighting="tukey"), rs.PBVS(GOAL, weighting="cauchy")):
        each = [
            rs.simulate(SCENE, task, starts(21), duration=1.0, sensing=lying, **given)
            for given in (how, {})
        ]
        for name in ("q", "qd", "s", "weight"):
            np.testing.assert_array_equal(each[0][name], each[1][name])


# poses


def views(runs, seed, noise=0.0):
    """Poses (runs, 4, 4) and pixels (runs, 9, 2) of the cloud."""
    rng = np.random.default_rng(seed)
    poses = rs.Pose.at(0, 0, 1) @ rs.Pose.exp(rng.normal(scale=0.3, size=(runs, 6)))
    X = np.einsum("bij,nj->bni", poses.matrix[:, :3, :3], CLOUD) + poses.matrix[:, None, :3, 3]
    pixels = 800 * X[..., :2] / X[..., 2:] + [320, 240]
    return poses.matrix, pixels + rng.normal(scale=noise, size=pixels.shape)


@pytest.mark.parametrize("kind", KINDS)
def test_exact_images_with_outliers_give_the_exact_pose_and_name_the_outliers(kind):
    T, pixels = views(20, 1)
    pixels[:, 2] += [40, -25]
    pixels[:, 7] += [-10, 60]
    plain = rs.vision.estimate_pose(CLOUD, pixels, CAMERA)
    found = rs.vision.estimate_pose(CLOUD, pixels, CAMERA, robust=kind)
    assert np.abs(plain.T_c_o - T).max(axis=(1, 2)).min() > 1e-3
    np.testing.assert_allclose(found.T_c_o, T, atol=1e-5 if kind == "huber" else 1e-9)
    honest = np.delete(found.weights, [2, 7], axis=1)
    assert found.weights[:, [2, 7]].max() < 1e-3
    assert honest.min() > 0.05
    assert (plain.weights == 1.0).all()


def test_without_outliers_the_weights_of_huber_agree_with_least_squares():
    """With a scale far above the noise all weights are 1."""
    _, pixels = views(10, 2, noise=0.1)
    plain = rs.vision.estimate_pose(CLOUD, pixels, CAMERA, noise=10.0)
    found = rs.vision.estimate_pose(CLOUD, pixels, CAMERA, noise=10.0, robust="huber")
    assert (found.weights == 1.0).all()
    np.testing.assert_allclose(found.T_c_o, plain.T_c_o, atol=1e-10)
    np.testing.assert_allclose(found.covariance, plain.covariance, rtol=1e-6, atol=1e-14)


def test_a_third_of_marks_that_lie_costs_less_than_twice_the_error_of_none():
    T, pixels = views(200, 3, noise=1.0)
    lying = pixels.copy()
    rng = np.random.default_rng(4)
    for each in lying:
        each[rng.choice(9, 3, replace=False)] += rng.normal(scale=30, size=(3, 2))
    off = {}
    for name, image, robust in (
        ("none lies", pixels, None),
        ("squares", lying, None),
        ("tukey", lying, "tukey"),
    ):
        found = rs.vision.estimate_pose(CLOUD, image, CAMERA, robust=robust, noise=1.0)
        away = found.T_c_o[:, :3, 3] - T[:, :3, 3]
        off[name] = np.median(np.linalg.norm(away, axis=1))
    assert off["squares"] > 8 * off["none lies"]
    assert off["tukey"] < 2 * off["none lies"]


def test_a_pose_has_the_same_bits_alone_and_among_others():
    _, pixels = views(50, 5, noise=1.0)
    pixels[::3, 4] += 30
    pixels[7, 0] = np.nan
    whole = rs.vision.estimate_pose(CLOUD, pixels, CAMERA, robust="tukey")
    for i in (0, 7, 30, 49):
        one = rs.vision.estimate_pose(CLOUD, pixels[i], CAMERA, robust="tukey")
        for name in ("candidates", "errors", "weights", "covariance", "ambiguous"):
            np.testing.assert_array_equal(getattr(one, name), getattr(whole, name)[i])
    assert np.isnan(whole.T_c_o[7]).all() and np.isnan(whole.weights[7]).all()
    assert whole.ambiguous[7]
