"""Weightings: how much a mark counts, and how the command follows."""

import functools

import numpy as np
import pytest
from poster import BESIDE, CAMERA, GOAL, HIDDEN, LESS, POSTER, SCENE

import robsim as rs
from robsim.kernels.control import mark_weights as kernels
from robsim.kernels.machine.program import evaluate_stages
from robsim.suites.camera_poses import make_flying_scene
from robsim.suites.published.vit_500 import FOCAL

GOAL_POSE = rs.Pose.from_quaternion(POSTER.goal[:3], POSTER.goal[3:])
LEFT, TOP, RIGHT, BOTTOM = -0.5, -0.5, 639.5, 479.5


def smooth(x):
    """6 x^5 - 15 x^4 + 10 x^3 from 0 to 1, and constant beyond."""
    x = np.clip(np.nan_to_num(x), 0, 1)
    return np.polyval([6, -15, 10, 0, 0, 0], x)


def border_weights(pixels, width=40.0):
    """By hand, of pixels (..., 2): the product over the four sides."""
    u, v = np.moveaxis(np.asarray(pixels), -1, 0)
    ways = u - LEFT, RIGHT - u, v - TOP, BOTTOM - v
    return np.prod([smooth(way / width) for way in ways], axis=0)


def by_kernel(pixels, width=40.0):
    """Weights (B,) of a single mark at pixels (B, 2)."""
    pixels = np.asarray(pixels, dtype=float)

    def add(program, marks):
        found = program.rows(1)
        given = {"camera": program.each(CAMERA.rows), "width": program.constant(width)}
        program.add(kernels.weight_border_distance, pixels=marks.reshape(1, 2), **given, out=found)
        return (found,)

    return evaluate_stages(add, [np.ascontiguousarray(pixels.T)], [(1,)])[0][0]


# the weight of a mark


def test_the_weight_is_the_product_of_a_polynomial_for_each_side():
    rng = np.random.default_rng(1)
    pixels = rng.uniform([-60, -60], [700, 540], (4000, 2))
    np.testing.assert_allclose(by_kernel(pixels), border_weights(pixels), rtol=0, atol=1e-14)
    corners = [[-0.5, 240], [639.5, 240], [320, -0.5], [320, 479.5], [-9, 240], [np.nan, 240]]
    assert by_kernel(corners).tolist() == [0.0] * 6
    assert by_kernel([[39.5, 39.5], [320, 240], [19.5, 240]]).tolist() == [1.0, 1.0, 0.5]


@pytest.mark.parametrize("joint", [LEFT, LEFT + 40])
def test_the_weight_has_two_continuous_derivatives_where_its_pieces_meet(joint):
    """It leaves the constants with the third power: halving the way makes the change an eighth."""
    h = 40.0 / 2.0 ** np.arange(6, 11)
    values = [by_kernel(np.stack([joint + sign * h, 0 * h + 240], 1)) for sign in (-1, 1)]
    constant, rising = sorted(values, key=np.ptp)
    assert np.ptp(constant) == 0.0
    away = np.abs(rising - constant[0])
    slopes = np.log2(away[:-1] / away[1:])
    np.testing.assert_allclose(slopes, 3, atol=0.1)
    np.testing.assert_allclose(away[-1] / (h[-1] / 40) ** 3, 10.0, rtol=0.02)


# the command of weighted least squares


def step(task, q, scene=SCENE, **how):
    return rs.simulate(scene, task, q, dt=0.02, duration=0.02, **how).isel(time=0)


def points_by_hand(q):
    """Normalised points (40, 2) and depths (40,) in the camera at q, without our projection."""
    T_c_w = np.linalg.inv(np.asarray(rs.Pose.from_quaternion(q[:3], q[3:]).matrix))
    X = POSTER.scene.object().marks @ T_c_w[:3, :3].T + T_c_w[:3, 3]
    return X[:, :2] / X[:, 2:], X[:, 2]


def interaction(points, depths):
    (x, y), i, o = points.T, 1 / depths, 0 * depths
    rows = [[-i, o, x * i, x * y, -(1 + x * x), y], [o, -i, y * i, 1 + y * y, -x * y, -x]]
    return np.moveaxis(np.array(rows), -1, 0).reshape(-1, 6)


@pytest.mark.parametrize("start", LESS[:6])
def test_the_command_agrees_with_numpys_weighted_least_squares_of_the_visible_marks(start):
    q = POSTER.starts[start]
    run = step(rs.IBVS(GOAL, gain=0.7, weighting=rs.weights.Border(width=60)), q)
    points, depths = points_by_hand(q)
    pixels = points * FOCAL + [319.5, 239.5]
    w = np.where(depths > 0, border_weights(pixels, 60.0), 0.0)
    assert 0 < (w > 0).sum() < 40 and ((w > 0) & (w < 1)).any()
    np.testing.assert_allclose(run.weight, np.repeat(w, 2), atol=1e-12)
    seen = np.repeat(w > 0, 2)
    error = (points - points_by_hand(POSTER.goal)[0]).ravel()[seen]
    rows = np.repeat(w, 2)[seen]
    L = interaction(points, depths)[seen]
    V = -0.7 * np.linalg.lstsq(rows[:, None] * L, rows * error, rcond=None)[0]
    np.testing.assert_allclose(run.camera_velocity, V, rtol=1e-9, atol=1e-12)
    assert np.isnan(run.error.values[~seen]).all()
    np.testing.assert_allclose(run.error_norm, np.linalg.norm(error), rtol=1e-12)


def test_weights_of_zero_and_one_are_marks_that_are_not_there_and_those_that_are():
    """With a border of hardly any width: the command of the marks in the image alone."""
    q = POSTER.starts[LESS[0]]
    seen = np.flatnonzero(SCENE.view(q).visibility == 0)
    some = rs.features.FeatureBlock("points", marks=seen.tolist())
    whole = step(rs.IBVS(GOAL, weighting=rs.weights.Border(width=1e-9)), q)
    scene = make_flying_scene(FOCAL, SCENE.object().marks[seen])
    alone = step(rs.IBVS(GOAL), q, scene)
    picked = step(rs.IBVS(GOAL, features=[some], weighting=rs.weights.Border(width=1e-9)), q)
    for run in (whole, picked):
        np.testing.assert_allclose(run.qd, alone.qd, rtol=1e-10, atol=1e-13)


def test_where_every_mark_counts_in_full_nothing_changes_but_rounding():
    q = BESIDE
    plain = rs.simulate(SCENE, rs.IBVS(GOAL), q, duration=1)
    inside = rs.weights.Border(width=5)
    for weighting in (inside, [inside, rs.weights.Fade()]):
        run = rs.simulate(SCENE, rs.IBVS(GOAL, weighting=weighting), q, duration=1)
        assert (run.weight == 1.0).all()
        np.testing.assert_allclose(run.qd, plain.qd, rtol=0, atol=1e-15)


# the command is continuous


def jump(task, q, dt, seconds, scene=SCENE, **how):
    """The largest change of the command from one period to the next."""
    run = rs.simulate(scene, task, q, dt=dt, duration=seconds, **how)
    return float(np.abs(np.diff(run.qd.values, axis=0)).max())


@pytest.mark.parametrize("scheme", [rs.IBVS, functools.partial(rs.IBVS, interaction="mean")])
def test_the_command_is_continuous_where_marks_cross_the_border(scheme):
    """Its change in a period falls with the period; with marks that count or do not, it stays."""
    q, periods = POSTER.starts[LESS[4]], 0.04 / 2.0 ** np.arange(4)
    first = rs.simulate(SCENE, scheme(GOAL, weighting="border"), q, dt=0.01, duration=2)
    used = (first.weight.values > 0).sum(axis=1)
    assert used[-1] > used[0] + 10
    faded = np.array([jump(scheme(GOAL, weighting="border"), q, dt, 2) for dt in periods])
    sudden = rs.weights.Border(width=1e-9)
    abrupt = np.array([jump(scheme(GOAL, weighting=sudden), q, dt, 2) for dt in periods])
    np.testing.assert_allclose(faded[:-1] / faded[1:], 2.0, atol=0.25)
    assert abrupt[-1] > 0.9 * abrupt[-2] and abrupt[-1] > 2.5 * faded[-1]


def test_the_command_is_continuous_where_marks_are_hidden_and_seen_again():
    q, periods = POSTER.starts[LESS[4]], 0.04 / 2.0 ** np.arange(4)
    seen = np.flatnonzero(border_weights(SCENE.view(q).pixels) == 1)
    hidden = rs.imperfections.Occlusion(seen[::2], start=0.4, end=1.2)
    how = {"seconds": 2, "sensing": rs.Sensing(occlusions=hidden)}
    both = rs.IBVS(GOAL, weighting=["border", rs.weights.Fade(time=0.3)])
    border = rs.IBVS(GOAL, weighting="border")
    faded, abrupt = (np.array([jump(t, q, dt, **how) for dt in periods]) for t in (both, border))
    np.testing.assert_allclose(faded[:-1] / faded[1:], 2.0, atol=0.25)
    assert abrupt[-1] > 0.9 * abrupt[-2] and abrupt[-1] > 2.5 * faded[-1]


def test_a_hidden_mark_counts_less_and_less_from_its_last_place_and_comes_back_so():
    q = BESIDE
    fade = rs.IBVS(GOAL, weighting=rs.weights.Fade(time=0.4))
    run = rs.simulate(SCENE, fade, q, dt=0.04, duration=2, sensing=HIDDEN)
    t = run.time.values
    down = smooth(1 - (t - 0.36) / 0.4)  # hidden in the image at 0.4 s, seen in the image at 1.2 s
    up = smooth((t - 1.16) / 0.4)
    expected = np.where(t < 1.18, down, up)
    np.testing.assert_allclose(
        run.weight.values[:, :18], expected[:, None].repeat(18, 1), atol=1e-12
    )
    assert (run.weight.values[:, 18:] == 1.0).all()
    gone = run.s.values[(t > 0.38) & (t < 1.18), :18]
    assert (gone == gone[0]).all()


# poses


@pytest.mark.parametrize("form", ["goal", "camera"])
def test_a_pose_agrees_with_the_visible_marks(form):
    """Hidden marks that stay in the task spoil it; with a weighting they do not count."""
    q = POSTER.starts[LESS[0]]
    task = rs.PBVS(GOAL, form=form, weighting="border")
    whole = rs.simulate(SCENE, task, q, duration=3)
    hidden = rs.simulate(SCENE, task, q, duration=3, sensing=HIDDEN)
    np.testing.assert_allclose(hidden.qd, whole.qd, atol=1e-11)
    blind = make_flying_scene(FOCAL, SCENE.object().marks)
    open_ = rs.MountedCamera("eye", rs.Camera(CAMERA.K), on="free_camera.body")
    endless = rs.Scene(blind.robots, blind.objects, open_)
    all_seen = rs.simulate(endless, rs.PBVS(GOAL, form=form), q, duration=3)
    np.testing.assert_allclose(whole.qd, all_seen.qd, atol=1e-9)


def test_a_pose_counts_its_marks_by_their_weights():
    """With noise: at the minimum of the weighted squares, their gradient is zero."""
    q, noise = POSTER.starts[LESS[0]], rs.Sensing(noise=0.5)
    run = step(rs.PBVS(GOAL, weighting="border"), q, sensing=noise)
    image = step(rs.IBVS(GOAL, weighting="border"), q, sensing=noise)  # the same noise
    w, x = image.weight.values[::2], image.s.values.reshape(-1, 2)
    T_goal_c = np.eye(4)
    T_goal_c[:3, 3] = run.s.values[:3]
    T_goal_c[:3, :3] = np.asarray(rs.Pose.at(0, 0, 0, rotvec=run.s.values[3:]).matrix)[:3, :3]
    T_goal_o = np.linalg.inv(np.asarray(GOAL_POSE.matrix))
    X = SCENE.object().marks @ (M := np.linalg.inv(T_goal_c) @ T_goal_o)[:3, :3].T + M[:3, 3]
    here = w > 0
    e = ((X[:, :2] / X[:, 2:]) - x)[here].ravel()
    W, L = np.repeat(w[here] ** 2, 2), interaction(X[here, :2] / X[here, 2:], X[here, 2])
    slope = L.T @ (W * e)
    plain = L.T @ e
    assert np.abs(slope).max() < 1e-9 and np.abs(plain).max() > 1e-4


# weightings of a user's


class Trusting:
    """Counts marks in the left half in full, and marks in the right half by half."""

    def weigh(self, now):
        assert len(now.groups) == now.error.shape[1] // 2 and now.tolerances.shape == (80,)
        assert (now.error[now.weights == 0] == 0).all()
        return np.where(np.arange(80) % 16 < 8, 1.0, 0.5) + 0.0 * now.error


def test_a_weighting_of_a_users_multiplies_the_others():
    starts = POSTER.starts[LESS[:3]]
    border = rs.simulate(SCENE, rs.IBVS(GOAL, weighting="border"), starts, duration=0.2)
    both = rs.IBVS(GOAL, weighting=["border", Trusting()])
    run = rs.simulate(SCENE, both, starts, duration=0.2)
    half = np.where(np.arange(80) % 16 < 8, 1.0, 0.5)
    np.testing.assert_array_equal(run.weight[:, 0], half * border.weight.values[:, 0])
    alone = rs.simulate(SCENE, both, starts[1], duration=0.2)
    np.testing.assert_array_equal(alone.qd, run.qd[1])


# goals that are given


def test_the_goal_may_be_given_as_numbers():
    s = points_by_hand(POSTER.goal)[0].ravel()
    start, how = POSTER.starts[LESS[0]], {"duration": 1.0}
    given = rs.simulate(SCENE, rs.IBVS(rs.GoalFeatures(s), weighting="border"), start, **how)
    shown = rs.simulate(SCENE, rs.IBVS(GOAL, weighting="border"), start, **how)
    np.testing.assert_allclose(given.qd, shown.qd, atol=1e-12)
