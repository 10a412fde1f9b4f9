"""Advice before a simulation against closed forms, and against the simulation itself."""

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robsim as rs
from robsim.analysis.linearisation.caveats import generate_caveats
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.noise_floor import compute_noise_floor
from robsim.analysis.linearisation.perturbations import generate_perturbations
from robsim.analysis.linearisation.stability_limit import find_largest_factor, find_limiting_cause
from robsim.analysis.task_tree import list_servo_tasks

MARKS = np.array([[-0.06, -0.06, 0], [0.06, -0.05, 0], [0.05, 0.06, 0], [-0.06, 0.05, 0.02]])
EYE = rs.Camera([[800, 0, 500], [0, 800, 500], [0, 0, 1]], size=(1000, 1000))
OUT_OF_REACH = 38  # the end that this belief leads to
CASES = [i for i in range(51) if i != OUT_OF_REACH]
IMAGES = 2000
START, GROWN, REST = 1e-7, 1e-4, 1e-10  # metres and radians: at first, later, and of nothing


def example(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes)


@cache
def scene_of(which):
    """A camera that flies, one in the hand of an arm, and one that watches an arm."""
    if which == "free":
        at = rs.Pose.at(0.02, -0.03, 0.6, rotvec=(0.2, 0.1, -0.15))
        eye = rs.MountedCamera("eye", EYE, on="free_camera.body")
        return rs.Scene(
            [rs.robots.free_camera()], [rs.Object("plate", marks=MARKS, pose=at)], [eye]
        )
    if which == "in hand":
        robot = replace(rs.robots.puma560(), home=np.radians([1, 81, -199, 1, -61, 2]))
        plate = rs.Object("plate", marks=MARKS, pose=rs.Pose.at(0.45, -0.15, 0.25))
        eye = rs.MountedCamera("eye", EYE, on="puma560.flange", pose=rs.Pose.at(0, 0, 0.07))
        return rs.Scene([robot], [plate], [eye])
    held = rs.Object("plate", marks=MARKS, on="puma560.flange", pose=rs.Pose.at(0, 0, 0.08))
    eye = rs.MountedCamera("eye", EYE, pose=rs.Pose.at(0.45, -0.15, 0.1))
    return rs.Scene([rs.robots.puma560()], [held], [eye])


def goal_at_home(scene):
    """The pose of the target in the camera at home, as a goal that is computed."""
    T_w_c, T_w_o = (rs.Pose(np.asarray(scene.pose(name))) for name in ("eye", "plate"))
    return rs.GoalPose(T_w_c.inv() @ T_w_o)


def wrong(scene, rng):
    """A belief with mistakes in the lens, the mount, the target and the links."""
    dh = {}
    if scene.robots[0].name == "puma560":
        dh = {"forearm": {"theta": rng.normal(0, 0.1), "a": rng.normal(0, 0.02)}}
    mount = rs.Pose.at(*rng.normal(0, 0.01, 3), rotvec=rng.normal(0, 0.15, 3))
    focal, size = rng.uniform(0.8, 1.3), rng.uniform(0.8, 1.2)
    return scene.believe(focal=focal, hand_eye=mount, size=size, dh=dh)


def random_case(i):
    """A scene, a law, beliefs and times at random; every fifth has a goal that is computed."""
    rng = np.random.default_rng([i, 560])
    scene = scene_of(["free", "in hand", "to hand"][i % 3])
    L = str(rng.choice(["current", "desired", "mean"]))
    tasks = [
        lambda **k: rs.IBVS(interaction=L, depth_scale=rng.uniform(0.6, 1.6), **k),
        lambda **k: rs.IBVS(features=rs.features.PixelPoints(), interaction=L, **k),
        lambda **k: rs.IBVS(law="camera", interaction=L, **k),
        rs.PBVS,
        lambda **k: rs.IBVS(inverse=rs.laws.DampedInverse(0.05), **k),
        rs.Hybrid,
        lambda **k: rs.IBVS(inverse=rs.laws.JacobianTranspose(), **k),
    ]
    belief = wrong(scene, rng) if rng.random() < 0.75 else None
    goal = goal_at_home(scene) if i % 5 == 3 else None
    dt, every = float(rng.choice([0.02, 0.04])), int(rng.choice([1, 1, 2, 4]))
    latency, lag = (rng.uniform(0, 5) * dt * float(rng.random() < p) for p in (0.75, 0.5))
    return rs.Experiment(
        scene,
        tasks[i % len(tasks)](belief=belief, goal=goal),
        sensing=rs.Sensing(latency=latency, period=every * dt),
        actuation=rs.Actuation(lag=lag),
        dt=dt,
    )


def linear_of(experiment):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.RankWarning)
        return LinearLoop.of(experiment)


def limit_of(experiment):
    """The largest gain and its reason, as advice has them, without the time for the rest."""
    linear = linear_of(experiment)
    (leaf,) = list_servo_tasks(linear.task)
    gain = leaf.gain
    return gain * find_largest_factor(linear.gain_dependence, linear.timing), find_limiting_cause(
        experiment, linear, gain
    )


def grows(experiment, linear, gain):
    """Whether a motion of 1e-7 away from rest grows with this gain, in a run of 2,000 images."""
    away = linear.response.basis.sum(axis=1, keepdims=True)
    q0 = linear.field.displace(linear.q, START * away / np.linalg.norm(away))[:, 0]
    task = replace(experiment.task, gain=float(gain))
    duration = IMAGES * linear.timing.period
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.RankWarning)
        run = experiment.with_(task=task, start=q0, duration=duration, hold=True).run()
    far = np.abs(run.q.values - linear.q[:, 0]).max(axis=1)
    far = far[np.isfinite(far)]
    early, late = (np.sqrt(np.mean(part**2)) for part in np.array_split(far, 4)[1::2])
    return far.max() > GROWN or late > max(early, REST)


@pytest.mark.parametrize(
    "i", [*CASES[:6], *(pytest.param(i, marks=pytest.mark.full) for i in CASES[6:])]
)
def test_three_percent_below_the_limit_decays_and_three_above_grows(i):
    experiment = random_case(i)
    linear = linear_of(experiment)
    limit = find_largest_factor(linear.gain_dependence, linear.timing)
    if limit == 0.0:  # the belief is so wrong that no gain helps
        assert linear.gain_dependence.rates[0].real < 0 and grows(experiment, linear, 0.1)
        return
    assert not grows(experiment, linear, 0.97 * limit)
    assert grows(experiment, linear, 1.03 * limit)


def test_the_secondary_motion_has_its_own_rate():
    """A posture is read from the joints at once, while images are rare and late and joints lag."""
    plate = rs.Object("plate", marks=MARKS, pose=rs.Pose.at(0.31, 0, 0.1))
    eye = rs.MountedCamera("eye", EYE, on="panda.flange")
    scene = rs.Scene([rs.robots.panda()], [plate], [eye])
    belief = scene.believe(focal=1.1, hand_eye=rs.Pose.at(rpy=(0.1, 0.2, 0.1)))
    task = rs.IBVS(belief=belief, secondary=rs.laws.Posture(scene.home + 0.05))
    times = {"sensing": rs.Sensing(latency=0.03, period=0.12), "actuation": rs.Actuation(lag=0.05)}
    experiment = rs.Experiment(scene, task, **times)
    linear = linear_of(experiment)
    assert not linear.gain_dependence.is_proportional and linear.response.basis.shape == (7, 7)
    limit = find_largest_factor(linear.gain_dependence, linear.timing)
    assert not grows(experiment, linear, 0.97 * limit)
    assert grows(experiment, linear, 1.03 * limit)


@pytest.mark.parametrize(
    ("name", "change", "limit", "cause"),
    [
        ("latency_and_gain", "task.gain=1", 2 * np.sin(np.pi / 10) / 0.04, "80 ms of latency"),
        ("latency_and_gain", "sensing.latency=0 ms", 50, "the control period of 40 ms"),
        ("latency_and_gain", "sensing.latency=10 ms", 100, "the control period of 40 ms"),
        ("latency_and_gain", "sensing.latency=2 s", 2 * np.sin(np.pi / 202) / 0.04, "2e+03 ms of"),
        ("slow_camera", "task.gain=1", 12.5, "images every 160 ms"),
        ("depth_scale", "task.gain=1", None, "wrong beliefs"),
    ],
)
def test_the_largest_gain_of_closed_forms(name, change, limit, cause):
    """2 sin(pi / (2 (2 d + 1))) for d periods of latency; 2 over the time between images.

    With all depths wrong by one factor the fastest motion is as much faster.
    """
    found, why = limit_of(example(name, change))
    if limit is None:
        limit = 50 / example(name).task.depth_scale
    assert found == pytest.approx(limit, rel=1e-3 if "2 s" in change else 1e-6)
    assert cause in why


@pytest.mark.parametrize("lost", [0.1, 0.6])
def test_the_mean_square_of_lost_images(lost):
    """With one image in 1/(1 - p) periods, it settles below gain dt = 2 (1 - p) / (1 + p)."""
    changes = ["sensing.period=40 ms", f"sensing.dropped={lost}"]
    found, why = limit_of(example("slow_camera", *changes))
    assert 0.04 * found == pytest.approx(2 * (1 - lost) / (1 + lost), rel=1e-4)
    assert why == f"{100 * lost:.3g} % of lost images"


@pytest.mark.parametrize("gain", [2.5, 12.5, 30.0])
def test_the_noise_of_the_closed_form(gain):
    """Of four marks 6 sigma^2 g / (2 - g) in all, and g / (2 - g) (L'L)^-1 of the camera."""
    linear = linear_of(example("noise_floor", f"task.gain={gain}"))
    found = compute_noise_floor(
        linear.response, linear.gain_dependence, linear.timing, 1.0, np.zeros(6)
    )
    share = 0.04 * gain / (2 - 0.04 * gain)
    rows = []
    for X, Y in 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]):
        x, y, Z = X / 0.5, Y / 0.5, 0.5
        rows += [[-1 / Z, 0, x / Z, x * y, -(1 + x * x), y]]
        rows += [[0, -1 / Z, y / Z, 1 + y * y, -x * y, -x]]
    L = 600 * np.array(rows)
    variances = share * np.diag(np.linalg.inv(L.T @ L))
    expected = share * 6 / 4, variances[:3].sum(), variances[3:].sum()
    squares = np.square([found.pixels, found.metres, found.radians])
    np.testing.assert_allclose(squares, expected, rtol=1e-5)


@pytest.mark.parametrize(
    "changes",
    [
        {"sensing": rs.Sensing(noise=0.3, period=0.08, latency=0.05)},
        pytest.param(
            {"sensing": rs.Sensing(noise=0.3, dropped=0.3, latency=0.1)}, marks=pytest.mark.full
        ),
        pytest.param(
            {
                "sensing": rs.Sensing(noise=0.3, outliers=0.1, outlier_size=3.0),
                "actuation": rs.Actuation(lag=0.1),
            },
            marks=pytest.mark.full,
        ),
    ],
    ids=["rare and late", "lost and late", "outliers and lag"],
)
def test_the_noise_of_runs(changes):
    """Over 200 runs of 4 s, with independent parts some 0.3 s long: within 4 percent."""
    experiment = example("noise_floor").with_(title=None, **changes)
    advice = rs.advise(experiment)
    start = np.tile(advice.q, (200, 1))
    run = experiment.with_(start=start, duration=6.0).run()
    pixels = (run.pixels - run.pixels_goal).values[:, 50:]
    poses = run.camera_pose.values[:, 50:]
    away = poses[..., :3, 3] - [0, 0, -0.5]
    turned = rs.Pose(poses.reshape(-1, 4, 4)).rotvec
    each = (np.sqrt((x**2).sum(-1).mean()) for x in (pixels, away, turned))
    noise = advice.noise
    np.testing.assert_allclose([*each], [noise.pixels, noise.metres, noise.radians], rtol=0.04)


def test_encoders_leave_no_noise_where_only_the_jacobian_reads_them():
    experiment = example("joint_lag", "actuation.encoder=0.5 deg")
    linear = linear_of(experiment)
    noise = compute_noise_floor(
        linear.response, linear.gain_dependence, linear.timing, 0.0, np.full(6, 0.003)
    )
    assert noise.pixels < 1e-9
    assert experiment.run(record="summary").outcome == rs.Outcome.CONVERGED


def camera_in_target(scene, q):
    T_w_c, T_w_o = (rs.Pose(np.asarray(scene.pose(name, q))) for name in ("eye", "plate"))
    return T_w_o.inv() @ T_w_c


@pytest.mark.full
def test_the_predicted_shift_of_a_mistake_is_the_end_of_runs():
    """All errors of the belief of an arm with a computed goal, to the second order of each."""
    scene = scene_of("in hand")
    task = rs.IBVS(goal=goal_at_home(scene), belief=scene.believe(focal=1.02), gain=4.0)
    experiment = rs.Experiment(scene, task, start=scene.home + 0.02, duration=10, hold=True)
    advice = rs.advise(experiment)
    assert advice.metres == pytest.approx(0.011, rel=0.01)
    here, far = camera_in_target(scene, advice.q), advice.effects[0].metres
    every = {
        each.name: each for each in generate_perturbations(task, scene, task.bind(scene).sights)
    }
    assert len(advice.effects) == len(every) == 48
    for effect in (*advice.effects[:5], advice.effects[-1]):
        wrong_task = every[effect.name].apply(task, scene)
        q_end = experiment.run(task=wrong_task, record="summary").q_end.values
        moved = here.inv() @ camera_in_target(scene, q_end)
        assert np.linalg.norm(moved.position) == pytest.approx(effect.metres, rel=0.01, abs=1e-9)
        assert np.linalg.norm(moved.rotvec) == pytest.approx(effect.radians, rel=0.02, abs=3e-5)
        assert effect.metres <= far


def test_mistakes_leave_a_shown_goal_where_it_is():
    advice = rs.advise(example("wrong_dh"))
    assert not any(effect.moves for effect in advice.effects)
    lowered = [min(effect.limit, effect.rate) for effect in advice.effects]
    assert lowered == sorted(lowered) and lowered[0] < -0.005
    assert "Calibration: no small mistake moves the end, but" in str(advice)


def test_the_limit_of_a_small_mistake_agrees_with_the_task_which_makes_it():
    experiment = example("depth_scale")
    before = rs.advise(experiment)
    effects = {effect.name: effect for effect in before.effects}
    scale = 1.01 * experiment.task.depth_scale
    after, _ = limit_of(experiment.with_(task=replace(experiment.task, depth_scale=scale)))
    change = after / before.largest_gain - 1
    assert effects["task.depth_scale"].limit == pytest.approx(change, rel=1e-6)


class Own:
    """A law of a user: the transpose."""

    def command(self, state):
        A, e = state.task_jacobian_last, state.error_last
        return -state.gain * np.einsum("knb,kb->nb", A, e).T


def test_a_law_of_a_user_is_as_the_one_that_is_built_in():
    base = example("latency_and_gain")
    own, ours = (
        limit_of(base.with_(task=replace(base.task, **change)))[0]
        for change in ({"law": Own()}, {"inverse": rs.laws.JacobianTranspose()})
    )
    assert own == pytest.approx(ours, rel=1e-6)


def test_a_gain_that_adapts_counts_as_at_zero_error_and_a_smooth_start_not_at_all():
    base = example("latency_and_gain")
    gain = rs.laws.AdaptiveGain(at_zero=10.0, at_infinity=1.0, slope=30.0)
    advice = rs.advise(base.with_(task=replace(base.task, gain=gain, smooth_start=2.0)))
    assert advice.largest_gain == pytest.approx(limit_of(base)[0], rel=1e-9)
    assert advice.gain == 10.0
    assert advice.notes == ("the gain at zero error stands for an adaptive gain",)


def test_motions_that_are_left_free_are_no_part_of_it():
    experiment = example("eye_in_hand")
    assert limit_of(experiment)[0] == pytest.approx(50.0, rel=1e-6)
    said = list(generate_caveats(experiment, linear_of(experiment)))
    assert said == ["1 motion that the features leave free are not considered"]


def test_a_loop_that_leads_away_is_unstable_at_every_gain():
    advice = rs.advise(example("uneven_depth"))
    assert advice.margin == advice.largest_gain == 0.0 and advice.noise.pixels == np.inf
    assert "unstable at every gain" in advice.stability
    assert example("uneven_depth").run(record="summary").outcome != rs.Outcome.CONVERGED


@pytest.mark.full
def test_outliers_are_noise_where_no_robust_weights_leave_them_out():
    """In millimetres, rms; runs of the example give 27.6 and 4.7 from 10 s on."""
    plain, robust, noise = (
        rs.advise(example("marks_that_lie", change)).noise.metres * 1e3
        for change in ("task.gain=1", 'task.weighting=["tukey"]', "sensing.outliers=0")
    )
    assert robust == pytest.approx(noise, rel=1e-4)
    assert plain == pytest.approx(27.6, rel=0.1)
    assert robust == pytest.approx(4.7, rel=0.25)
    advice = rs.advise(example("marks_that_lie", 'task.weighting=["tukey"]'))
    assert [each for each in advice.notes if each.startswith("outliers have no part in the noise")]


def test_the_text_of_advice_shows_its_numbers():
    advice = rs.advise(example("noise_floor", "task.gain=60"))
    assert repr(advice).startswith("Advice(gain 60: stable up to 50 per second (limited by the")
    assert "1.2 times too high" in advice.stability
    assert "Noise: unbounded: the loop is unstable" in str(advice)
    assert "<table>" in advice._repr_html_() and advice.stability in advice._repr_html_()
    assert advice == replace(advice) != replace(advice, rate=0.0)


class Spring:
    """A law of a user that trusts the joints as well, which are never late."""

    def command(self, state):
        q = state.q_last.T - np.radians([1, 81, -199, 1, -61, 2])
        e = (
            np.linalg.pinv(state.task_jacobian_last.transpose(2, 0, 1))
            @ state.error_last.T[..., None]
        )
        return -state.gain * (0.7 * e[..., 0] + 0.3 * q)


def test_a_law_that_reads_the_joints_at_once_is_stable_for_longer():
    experiment = rs.Experiment(scene_of("in hand"), rs.IBVS(), sensing=rs.Sensing(latency=0.08))
    own = experiment.with_(task=rs.IBVS(law=Spring()))
    linear = linear_of(own)
    assert not linear.gain_dependence.is_image_only
    limit = find_largest_factor(linear.gain_dependence, linear.timing)
    assert limit > 1.2 * limit_of(experiment)[0]
    z, d = np.exp(1j * np.linspace(1e-3, np.pi, 200_000)), 2
    gains = -(z - 1) / (0.7 * z**-d + 0.3) / 0.04  # z is a root: z - 1 + g dt (...) = 0
    found = gains.real[:-1][np.diff(np.sign(gains.imag)) != 0]
    assert limit == pytest.approx(found[found > 0].min(), rel=1e-4)
