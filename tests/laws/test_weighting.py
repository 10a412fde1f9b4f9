"""Weightings: marks that come and go, and how the command follows them."""

import functools

import numpy as np
import pytest

import robsim as rs
from robsim.kernels import weighting as kernels
from robsim.kernels.program import evaluated
from robsim.suites.poses import flying
from robsim.suites.published import vit_500, vit_500_poster

POSTER = vit_500_poster.suite()
GOAL, FOCAL = POSTER.task_goal, vit_500.FOCAL
SCENE, CAMERA = POSTER.scene, POSTER.scene.camera().camera
LESS = [i for i, each in enumerate(POSTER.groups["square"]) if "less" in each]
BESIDE = POSTER.goal + np.array([0.01, -0.02, 0.03, 0, 0, 0, 0])
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
        camera, wide = program.each(CAMERA.rows), program.constant(width)
        program.add(kernels.border, 1, marks, camera, wide, found)
        return (found,)

    return evaluated(add, [np.ascontiguousarray(pixels.T)], [(1,)])[0][0]


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


# the command is that of weighted least squares


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
def test_the_command_is_that_of_numpys_weighted_least_squares_of_the_marks_that_are_seen(start):
    q = POSTER.starts[start]
    run = step(rs.IBVS(GOAL, gain=0.7, weighting=rs.Border(width=60)), q)
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
    some = rs.FeatureBlock("points", marks=seen.tolist())
    whole = step(rs.IBVS(GOAL, weighting=rs.Border(width=1e-9)), q)
    scene = flying(FOCAL, SCENE.object().marks[seen])
    alone = step(rs.IBVS(GOAL), q, scene)
    picked = step(rs.IBVS(GOAL, features=[some], weighting=rs.Border(width=1e-9)), q)
    for run in (whole, picked):
        np.testing.assert_allclose(run.qd, alone.qd, rtol=1e-10, atol=1e-13)


def test_where_every_mark_counts_in_full_nothing_changes_but_rounding():
    q = BESIDE
    plain = rs.simulate(SCENE, rs.IBVS(GOAL), q, duration=1)
    inside = rs.Border(width=5)
    for weighting in (inside, [inside, rs.Fade()]):
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
    sudden = rs.Border(width=1e-9)
    abrupt = np.array([jump(scheme(GOAL, weighting=sudden), q, dt, 2) for dt in periods])
    np.testing.assert_allclose(faded[:-1] / faded[1:], 2.0, atol=0.25)
    assert abrupt[-1] > 0.9 * abrupt[-2] and abrupt[-1] > 2.5 * faded[-1]


HIDDEN = rs.Sensing(occlusions=rs.Occlusion(range(9), start=0.4, end=1.2))


def test_the_command_is_continuous_where_marks_are_hidden_and_seen_again():
    q, periods = POSTER.starts[LESS[4]], 0.04 / 2.0 ** np.arange(4)
    seen = np.flatnonzero(border_weights(SCENE.view(q).pixels) == 1)
    hidden = rs.Occlusion(seen[::2], start=0.4, end=1.2)
    how = {"seconds": 2, "sensing": rs.Sensing(occlusions=hidden)}
    both = rs.IBVS(GOAL, weighting=["border", rs.Fade(time=0.3)])
    border = rs.IBVS(GOAL, weighting="border")
    faded, abrupt = (np.array([jump(t, q, dt, **how) for dt in periods]) for t in (both, border))
    np.testing.assert_allclose(faded[:-1] / faded[1:], 2.0, atol=0.25)
    assert abrupt[-1] > 0.9 * abrupt[-2] and abrupt[-1] > 2.5 * faded[-1]


def test_a_hidden_mark_counts_less_and_less_from_its_last_place_and_comes_back_so():
    q = BESIDE
    fade = rs.IBVS(GOAL, weighting=rs.Fade(time=0.4))
    run = rs.simulate(SCENE, fade, q, dt=0.04, duration=2, sensing=HIDDEN)
    t = run.time.values
    down = smooth(1 - (t - 0.36) / 0.4)  # hidden in the image of 0.4 s, seen in that of 1.2 s
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
def test_a_pose_is_that_of_the_marks_that_are_there(form):
    """Marks that are hidden spoil it where they stay; with a weighting they do not count."""
    q = POSTER.starts[LESS[0]]
    task = rs.PBVS(GOAL, form=form, weighting="border")
    whole = rs.simulate(SCENE, task, q, duration=3)
    hidden = rs.simulate(SCENE, task, q, duration=3, sensing=HIDDEN)
    np.testing.assert_allclose(hidden.qd, whole.qd, atol=1e-11)
    blind = flying(FOCAL, SCENE.object().marks)
    open_ = rs.MountedCamera("eye", rs.Camera(CAMERA.K), on="free_camera.body")
    endless = rs.Scene(blind.robots, blind.objects, open_)
    all_seen = rs.simulate(endless, rs.PBVS(GOAL, form=form), q, duration=3)
    np.testing.assert_allclose(whole.qd, all_seen.qd, atol=1e-9)


def test_a_pose_counts_its_marks_by_their_weights():
    """With noise: the minimum of the weighted squares, of which the gradient is zero."""
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


GOAL_POSE = rs.Pose.from_quaternion(POSTER.goal[:3], POSTER.goal[3:])


# what is left


def leaving(scene=SCENE, task=None, **how):
    """A run in which the poster is pulled away, along its x at 0.2 m/s, and hardly followed."""
    task = task or rs.IBVS(rs.TaughtGoal([*POSTER.goal, 0.0]), gain=1e-3, **how)
    along = rs.Pose.at(0, 0, 0, rpy=(0, np.pi / 2, 0))
    joint = rs.Joint("prismatic", place=along)
    rail = rs.Robot("rail", [rs.Link("base"), rs.Link("cart", "base", joint)])
    marks = scene.object().marks @ along.rotation  # in axes of the cart
    poster = rs.Object("square", marks=marks, on="rail.cart")
    moving = rs.Scene((*scene.robots, rail), poster, scene.cameras, [rs.Motion("rail", [0.2])])
    return rs.simulate(moving, task, [*BESIDE, 0.0], dt=0.04, duration=8)


def test_a_run_ends_out_of_image_where_too_few_marks_are_left():
    ends = {}
    for least in (1, 12, 40):
        run = leaving(weighting=rs.Border(least=least))
        marks = (run.weight.values[:, ::2] > 0).sum(axis=1)
        last = round(float(run.end_time) / 0.04)
        assert rs.Outcome(int(run.outcome)) is rs.Outcome.OUT_OF_IMAGE
        assert marks[last] < max(least, 6) <= marks[last - 1]  # five are in a column
        ends[least] = float(run.end_time)
    assert ends[40] < ends[12] < ends[1]


def test_without_the_weighting_the_same_run_ends_with_the_first_mark():
    plain, every = leaving(), leaving(weighting=rs.Border(least=40))
    assert float(plain.end_time) == float(every.end_time) > 0


def test_the_end_and_the_marks_are_told():
    run = leaving(weighting="border")
    told = rs.explain(run, trials=False)
    assert "too few marks are left to command: 5 of 40 are in the image, and L J" in told.what
    diagnosis = rs.diagnose(run)
    last = diagnosis.sizes["time"] - 1
    marks = diagnosis.marks_in_image.values
    assert marks[0] == 40 and marks[last] == 5 and diagnosis.rank_task_jacobian[last] == 5
    assert (diagnosis.rank_task_jacobian[:last] == 6).all()
    start = POSTER.starts[LESS[0]]
    arrived = rs.simulate(SCENE, rs.IBVS(GOAL, weighting="border"), start, duration=20)
    note = rs.explain(arrived)
    assert note.causes[0].about == "visibility"
    assert note.causes[0].evidence["least_marks"] == (SCENE.view(start).visibility == 0).sum()
    blind = rs.simulate(SCENE, rs.IBVS(GOAL), start, duration=20)
    assert "Try: With weighting='border' the same start" in str(rs.explain(blind))


def test_a_start_that_sees_too_little_is_told_before_the_run():
    away = rs.Pose.at(3.0, 0, 0.61, rpy=(np.pi, 0, 0)).q
    task = rs.IBVS(GOAL, weighting="border")
    with pytest.raises(rs.InputError, match="sees too few marks to command by"):
        rs.Experiment(SCENE, task, away).check()
    run = rs.simulate(SCENE, task, away)
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.OUT_OF_IMAGE and run.end_time == 0
    rs.Experiment(SCENE, task, POSTER.starts[LESS[0]]).check()


def test_a_singular_arm_is_not_taken_for_an_image_without_marks():
    """At the stretched elbow J has rank 5, and so has L J, though every mark is there."""
    scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    ends = []
    for weighting in ((), "border"):
        task = rs.IBVS(scenario.task.goal, weighting=weighting)
        run = rs.simulate(scenario.scene, task, scenario.start, duration=0.4)
        ends.append(int(run.outcome))
    assert ends[0] == ends[1]


def test_a_switch_goes_on_while_the_scheme_whose_turn_it_is_can():
    """One needs six marks at a side of the poster, and the other all that are there."""
    goal = rs.TaughtGoal([*POSTER.goal, 0.0])
    row = rs.FeatureBlock("points", marks=[7, 15, 23, 31, 39, 6])  # these leave first
    narrow = rs.IBVS(goal, gain=1e-3, features=[row], weighting="border")
    wide = rs.IBVS(goal, gain=1e-3, weighting="border")
    ends = [
        float(leaving(task=rs.Switch(*pair, when=rs.ErrorBelow(value, of="first"))).end_time)
        for pair in ((narrow, wide), (wide, narrow))
        for value in (10.0, 1e-9)
    ]
    alone = [float(leaving(task=task).end_time) for task in (narrow, wide)]
    assert ends == [alone[1], alone[0], alone[0], alone[1]] and alone[0] != alone[1]


# the same bits


def test_a_batch_has_the_bits_of_single_runs_in_any_chunks_and_threads():
    starts = POSTER.starts[LESS[:9]]
    for scheme in (rs.IBVS, rs.PBVS):
        task = scheme(GOAL, weighting=["border", rs.Fade(time=0.3)])
        how = {"dt": 0.04, "duration": 2, "sensing": HIDDEN}
        whole = rs.simulate(SCENE, task, starts, **how)
        parts = rs.simulate(SCENE, task, starts, **how, chunk=2, threads=2)
        for name in ("q", "qd", "s", "weight", "error_norm"):
            np.testing.assert_array_equal(whole[name], parts[name])
        for i in (0, 4, 8):
            alone = rs.simulate(SCENE, task, starts[i], **how)
            for name in ("q", "qd", "s", "weight"):
                np.testing.assert_array_equal(whole[name][i], alone[name])


# images that are late, lost or noisy


@pytest.mark.parametrize(
    "sensing",
    [
        rs.Sensing(latency=0.07, noise=0.3, dropped=0.2, period=0.08),
        rs.Sensing(quantisation=0.5, latency=0.1, outliers=0.02),
    ],
)
def test_a_mark_that_is_not_in_a_late_image_has_no_weight(sensing):
    task = rs.IBVS(GOAL, gain=0.5, weighting="border")
    run = rs.simulate(SCENE, task, POSTER.starts[LESS[0]], duration=4, sensing=sensing)
    assert np.isfinite(run.qd.values).all() and run.end_time == 4
    unseen = np.isnan(run.s.values)
    assert unseen.any() and (run.weight.values[unseen] == 0).all()
    assert run.error_norm[-1] < 0.5 * run.error_norm[0]


# weightings of a user's


class Trusting:
    """Counts the marks of the left half in full, and those of the right by half."""

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


# numbers of each run its own, and goals that are given


def test_runs_whose_cameras_and_marks_differ_have_the_bits_of_single_runs():
    task = rs.IBVS(GOAL, weighting=["border", "fade"])
    one = rs.Experiment(SCENE, task, POSTER.starts[LESS[0]], duration=1, sensing=HIDDEN)
    several = one.vary({"cameras.eye.focal": [480.0, 500.0, 520.0]})
    run = several.run()
    assert (
        np.isnan(run.s.values).any(axis=(1, 2)) & (run.weight.values < 1).any(axis=(1, 2))
    ).all()
    for i in range(3):
        np.testing.assert_array_equal(several.of_run(i).run().qd, run.qd[i])


def test_the_goal_may_be_given_as_numbers():
    s = points_by_hand(POSTER.goal)[0].ravel()
    start, how = POSTER.starts[LESS[0]], {"duration": 1.0}
    given = rs.simulate(SCENE, rs.IBVS(rs.GoalFeatures(s), weighting="border"), start, **how)
    shown = rs.simulate(SCENE, rs.IBVS(GOAL, weighting="border"), start, **how)
    np.testing.assert_allclose(given.qd, shown.qd, atol=1e-12)


# logs


def test_a_log_of_marks_that_come_and_go_is_the_run_again():
    """Every mark is seen before its first period, and some are not there in others."""
    task = rs.IBVS(GOAL, weighting="border")
    made = rs.Experiment(SCENE, task, BESIDE, dt=0.04, duration=0.4)
    run = made.run()
    rows = rs.table(run)
    hidden = [f"pixels[{i},{axis}]" for i in (3, 17) for axis in ("column", "row")]
    rows.loc[4:, hidden] = np.nan
    again = rs.read_log(rows, made)
    weights = run.weight.values.copy()
    weights[4:, [6, 7, 34, 35]] = 0
    np.testing.assert_array_equal(again.weight, weights)
    np.testing.assert_array_equal(np.isnan(again.error), weights == 0)
    assert rs.Outcome(int(again.outcome)) is rs.Outcome.RUNNING
    every = made.with_(task=rs.IBVS(GOAL))
    assert rs.Outcome(int(rs.read_log(rows, every).outcome)) is rs.Outcome.OUT_OF_IMAGE
