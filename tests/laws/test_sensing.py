"""Each imperfection of the images has an effect of known size, and no effect if it is off."""

import numpy as np
import pytest

import robsim as rs
from robsim.engine.chunk import ChunkProgress
from robsim.engine.image_stream import split_latency
from robsim.kernels.images.pixel_noise import quantise_rows
from robsim.kernels.machine.program import evaluate_stages
from robsim.servo.camera_target import CameraTarget
from robsim.servo.single_step import SingleStepController

VISP = rs.load_scenario(rs.examples.path("visp_tutorial"))
SCENE, TASK, Q0 = VISP.scene, VISP.task, VISP.start
GOAL = TASK.goal.q
F = SCENE.camera().camera.K[0, 0]
DT = 0.04


def closed(task=TASK, q0=Q0, duration=2.0, dt=DT, actuation=None, **sensing):
    sensing = rs.Sensing(**sensing)
    return rs.simulate(
        SCENE, task, q0, dt=dt, duration=duration, sensing=sensing, actuation=actuation, hold=True
    )


def in_pixels(**changes):
    return rs.IBVS(goal=GOAL, features="pixels", gain=0.5, **changes)


def flat(pixels):
    return pixels.values.reshape(*pixels.shape[:-2], -1)


def same(a, b):
    for name in b.data_vars:
        np.testing.assert_array_equal(a[name].values, b[name].values, err_msg=name)


@pytest.mark.parametrize("task", [TASK, rs.PBVS(GOAL), rs.Hybrid(GOAL)])
def test_an_imperfection_that_is_off_changes_no_bit(task):
    plain = rs.simulate(SCENE, task, Q0, duration=2.0)
    perfect = rs.Sensing(noise=0, quantisation=0, outliers=0, dropped=0, latency=0, period=None)
    exact = rs.Actuation(lag=0, velocity=None, acceleration=None, encoder=0)
    same_run = rs.simulate(SCENE, task, Q0, duration=2.0, sensing=perfect, actuation=exact)
    assert same_run.identical(plain)


@pytest.mark.parametrize("believed", [SCENE, SCENE.believe()])
def test_a_belief_that_is_the_truth_changes_no_bit(believed):
    same(
        rs.simulate(SCENE, rs.IBVS(GOAL, belief=believed), Q0, duration=2.0),
        rs.simulate(SCENE, rs.IBVS(GOAL), Q0, duration=2.0),
    )


@pytest.mark.parametrize(
    "nothing",
    [
        {"period": DT},  # an image in every period
        {"occlusions": [rs.imperfections.Occlusion([0], 100.0)]},  # after the end
        {"dropped": 1e-300},  # never
        {"outliers": 1e-300},
    ],
)
def test_the_long_way_round_gives_the_same_bits(nothing):
    """Images that go through frames without any imperfection give the plain loop."""
    same(closed(**nothing), closed())


def test_a_pixel_of_noise_has_the_predicted_variance_in_s():
    """1 px in pixels, 1/f in normalised points, to 5 sigma of the estimate from 1,632 numbers."""
    starts = np.repeat(Q0[None], 4, axis=0)
    for task, sigma in ((in_pixels(), 1.0), (TASK, 1.0 / F)):
        run = closed(task, starts, noise=1.0)
        error = run.s.values - (flat(run.pixels) if sigma == 1.0 else _normalised(run))
        count = error.size
        assert error.var() / sigma**2 == pytest.approx(1.0, abs=5 * np.sqrt(2 / count))
        assert abs(error.mean()) / sigma < 5 / np.sqrt(count)


def _normalised(run):
    K = SCENE.camera().camera.K
    x = (run.pixels.values - K[:2, 2]) / np.diag(K)[:2]
    return x.reshape(*x.shape[:-2], -1)


@pytest.mark.parametrize("step", [1.0, 0.25])
def test_quantised_pixels_are_whole_steps_and_err_by_their_uniform_distribution(step):
    starts = rs.Pose(SCENE.pose("camera", Q0).matrix).q + np.random.default_rng(1).uniform(
        -0.02, 0.02, (50, 7)
    ) * [1, 1, 1, 0, 0, 0, 0]
    run = closed(in_pixels(), starts, quantisation=step, duration=0.4)
    s, error = run.s.values / step, run.s.values - flat(run.pixels)
    np.testing.assert_allclose(s, np.round(s), rtol=0, atol=1e-9)
    assert np.abs(error).max() <= step / 2 + 1e-9
    assert error.var() == pytest.approx(step**2 / 12, rel=0.05)


def test_marks_behind_the_camera_are_not_seen_in_steps_either():
    behind = rs.Pose(SCENE.pose("camera", Q0).matrix) @ rs.Pose.at(rotvec=(0, np.pi, 0))
    run = closed(in_pixels(), behind.q, quantisation=0.5)
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.BEHIND_CAMERA
    assert np.isnan(run.s.values[0]).all()


def quantised(step, pixels):
    def add(program, rows):
        program.add(quantise_rows, every=1, values=rows.flat, size=program.constant(step))
        return (rows,)

    return evaluate_stages(add, [pixels], [pixels.shape[:-1]])[0]


def test_a_pixel_too_large_to_count_is_not_taken_for_another():
    pixels = np.array([1e300, -1e25, np.inf, np.nan, 1e15 + 0.25, 7.4]).reshape(1, 2, 3)
    rounded = pixels.copy()
    rounded[:, :, :2] = quantised(1e-3, rounded[:, :, :2])
    rounded = quantised(0.5, rounded)
    np.testing.assert_array_equal(rounded.ravel()[:4], pixels.ravel()[:4])
    assert rounded.ravel()[5] == 7.5


def test_many_occlusions_can_be_repeated_from_the_text_of_the_run():
    many = [
        rs.imperfections.Occlusion([i % 4], 0.1 + 0.001 * i, 0.2 + 0.001 * i) for i in range(300)
    ]
    run = closed(duration=0.4, occlusions=many)
    assert rs.replay(run).identical(run)


@pytest.mark.filterwarnings("ignore::robsim.errors.UnitWarning")
def test_an_image_later_than_the_run_leaves_the_first_image():
    """Later than any run, or rarer than any number of periods."""
    for late in ({"latency": 1e300}, {"latency": 100.0}, {"period": 1e308}, {"period": 100.0}):
        s = closed(duration=0.4, **late).s.values
        np.testing.assert_array_equal(s, np.broadcast_to(s[0], s.shape))


def test_occlusions_may_come_from_a_generator():
    hidden = rs.imperfections.Occlusion([0], 1.0)
    assert rs.Sensing(occlusions=(each for each in [hidden])).occlusions == (hidden,)


def test_outliers_are_the_share_and_the_size_that_was_requested():
    starts = np.repeat(Q0[None], 100, axis=0)
    run = closed(in_pixels(), starts, outliers=0.2, outlier_size=30.0, duration=0.8)
    away = (run.s.values - flat(run.pixels)).reshape(-1, 4, 2)
    hit = np.abs(away).max(axis=-1) > 1e-9
    share = hit.mean()
    assert share == pytest.approx(0.2, abs=5 * np.sqrt(0.2 * 0.8 / hit.size))
    assert away[hit].std() == pytest.approx(30.0, rel=0.05)
    at_once = hit.reshape(100, -1, 4)
    assert len(np.unique(at_once.sum(axis=(1, 2)))) > 5  # runs differ


def test_a_lost_image_is_the_one_before_to_the_bit():
    starts = np.repeat(Q0[None], 60, axis=0)
    run = closed(in_pixels(), starts, dropped=0.3, duration=2.0)
    s, true = run.s.values, flat(run.pixels)
    fresh = (s == true).all(axis=-1)
    assert fresh[:, 0].all()
    assert (~fresh).mean() == pytest.approx(0.3, abs=5 * np.sqrt(0.21 / fresh.size) + 0.3 / 51)
    for row in range(60):
        for k in np.flatnonzero(~fresh[row]):
            np.testing.assert_array_equal(s[row, k], s[row, k - 1])


@pytest.mark.parametrize("task", [in_pixels(), rs.PBVS(GOAL)])
def test_each_run_may_have_a_latency_of_its_own(task):
    """The stages read it from rows: there, and alone, the bits are the same."""
    own = np.array([0.0, 0.055, 0.08, 0.13, 9.9])
    options = {"dt": DT, "duration": 1.0, "hold": True}
    sensing = rs.Sensing(
        latency=0.13, noise=0.3, occlusions=[rs.imperfections.Occlusion([1], 0.2, 0.4)]
    )
    starts = np.repeat(Q0[None], len(own), axis=0)
    loop = rs.Experiment(SCENE, task, starts, sensing=sensing, **options).loop()
    program, images = loop.sequence.program, loop.sequence.images
    delay, share = split_latency(own, DT, loop.steps)
    rows = {images.latency: own, images.delay: delay, images.share: share}
    rows[images.ahead] = share * DT
    program.run_rows += [(at, values[None]) for at, values in rows.items()]
    loop.advance(ChunkProgress(np.arange(len(own))), lambda done: None)
    for i, latency in enumerate(own):
        sensing = rs.Sensing(0.3, latency=latency, occlusions=sensing.occlusions)
        alone = rs.simulate(SCENE, task, Q0, first_run=i, sensing=sensing, **options)
        for name in ("q", "s"):
            np.testing.assert_array_equal(getattr(loop.recorder.series, name)[i], alone[name])


def test_too_many_images_on_their_way_are_refused_before_anything_runs(monkeypatch):
    monkeypatch.setattr("robsim.engine.image_stream.get_free_memory", lambda: 4e9)
    with pytest.raises(
        rs.errors.InputError, match=r"latency: 9000000 delayed images .* 6.9 GB, and 4.0 GB are"
    ):
        closed(latency=9.0, duration=10.0, dt=1e-6)


@pytest.mark.parametrize("periods", [1, 2, 5])
def test_features_late_by_whole_periods_agree_with_the_past_to_the_bit(periods):
    run = closed(in_pixels(), latency=periods * DT)
    s, true = run.s.values, flat(run.pixels)
    np.testing.assert_array_equal(s[periods:], true[:-periods])
    for k in range(periods):  # until then, the first image
        np.testing.assert_array_equal(s[k], true[0])


@pytest.mark.parametrize("task", [TASK, in_pixels(interaction="mean"), rs.PBVS(GOAL)])
def test_the_command_is_the_law_on_the_features_of_the_step_before_to_the_bit(task):
    run = closed(task, latency=DT, duration=0.8)
    loop = rs.Experiment(SCENE, task, Q0).loop()
    eye = CameraTarget(SCENE, SCENE.camera(), SCENE.object())
    for k in range(1, 20):
        then, now = (np.ascontiguousarray(run.q.values[i][:, None]) for i in (k - 1, k))
        seen = eye.project(then)
        alone = SingleStepController(loop.controller, DT)
        given = {eye.key: seen.pixels}, {eye.key: seen.depth}
        command = alone.decide(alone.begin(1), k, now, *given).command
        np.testing.assert_array_equal(command.qd[:, 0], run.qd.values[k])


@pytest.mark.parametrize("share", [0.25, 0.5, 1.75])
def test_late_by_a_part_of_a_period_the_image_was_taken_on_the_arc_between(share):
    """The camera flew T exp(V t); its image is the image of a camera that stands there."""
    run, whole = closed(in_pixels(), latency=share * DT), int(np.ceil(share))
    for k in range(whole, 30):
        V = run.qd.values[k - whole]
        T = rs.Pose(run.camera_pose.values[k - whole]) @ rs.Pose.exp(V * (whole - share) * DT)
        np.testing.assert_allclose(
            run.s.values[k], SCENE.view(T.q).pixels.ravel(), rtol=0, atol=1e-9
        )


def test_a_slow_camera_repeats_its_image():
    run = closed(in_pixels(), period=3 * DT)
    s, true = run.s.values, flat(run.pixels)
    for k in range(len(s)):
        np.testing.assert_array_equal(s[k], true[3 * (k // 3)])


def test_hidden_marks_are_left_out_and_keep_their_last_place():
    """While mark 1 is hidden, the command equals the command of a task of the other three."""
    hidden = rs.imperfections.Occlusion([1], 0.5, 1.0)
    run = closed(in_pixels(), occlusions=hidden)
    steps = np.flatnonzero(np.isin(run.time.values.round(6), np.arange(0.52, 1.0, 0.04).round(6)))
    three = rs.IBVS(GOAL, features=[rs.features.FeatureBlock("pixels", marks=[0, 2, 3])], gain=0.5)
    assert len(steps) == 12
    for k in steps:
        np.testing.assert_array_equal(run.s.values[k, 2:4], flat(run.pixels)[steps[0] - 1, 2:4])
        alone = rs.simulate(SCENE, three, run.q.values[k], duration=DT, dt=DT)
        np.testing.assert_allclose(run.qd.values[k], alone.qd.values[0], rtol=0, atol=1e-12)
    after = steps[-1] + 1
    np.testing.assert_array_equal(run.s.values[after:], flat(run.pixels)[after:])


@pytest.mark.parametrize("task", [TASK, rs.PBVS(GOAL)])
def test_where_nothing_is_left_the_last_place_counts_until_marks_are_seen_again(task):
    all_marks = rs.imperfections.Occlusion(range(4), 0.4, 0.8)
    run = closed(task, occlusions=all_marks)
    s = run.s.values
    still = np.broadcast_to(s[9], s[10:20].shape)
    np.testing.assert_allclose(s[10:20], still, rtol=0, atol=1e-12)  # a pose is fitted once more
    assert np.abs(s[20] - s[19]).max() > 1e-3
    assert np.abs(run.qd.values[10:20]).max(axis=1).min() > 0.1  # it goes on


@pytest.mark.parametrize("late", [0, 1, 2])
def test_marks_are_hidden_in_the_images_of_that_time_however_late_these_are(late):
    """0.12 s - 0.04 s is a rounding below 0.08 s, the time of the third image."""
    hidden = rs.imperfections.Occlusion([1], 2 * DT, 5 * DT)
    run = closed(in_pixels(), latency=late * DT, occlusions=hidden, duration=0.5)
    s, last = run.s.values[:, 2:4], flat(run.pixels)[1, 2:4]
    kept = np.flatnonzero((s == last).all(axis=1))
    np.testing.assert_array_equal(kept, np.arange(1, 5) + late)  # the last one, then three more


def test_three_marks_are_enough_to_arrive():
    """Near the goal. Hidden from 0.5 s on, far away, the camera finds another of the poses from
    which three marks are seen at the same places.
    """
    for start, there in ((4.0, True), (0.5, False)):
        sensing = rs.Sensing(occlusions=[rs.imperfections.Occlusion([3], start)])
        run = rs.simulate(SCENE, TASK, Q0, duration=30, sensing=sensing)
        assert run.outcome == rs.Outcome.CONVERGED
        away = SCENE.view(run.q_end.values).pixels - SCENE.view(GOAL).pixels
        assert np.abs(away[:3]).max() < 0.02
        assert (np.abs(run.q_end.values[:3] - GOAL[:3]).max() < 2e-4) == there


def test_a_feature_of_all_marks_keeps_the_last_place_of_a_hidden_one():
    run = closed(rs.PBVS(GOAL), occlusions=rs.imperfections.Occlusion([1], 0.5, 1.0))
    assert np.isfinite(run.s.values).all()
    assert closed(rs.PBVS(GOAL)).s.values[:12] == pytest.approx(run.s.values[:12], abs=0)


class Spread:
    """A user's feature of all marks at once, by LAPACK, which raises if it meets a NaN."""

    unit, tolerance = "1", 1e-5

    def measure(self, seen):
        x = seen.points - seen.points.mean(axis=1, keepdims=True)
        return np.linalg.svd(x, compute_uv=False)


def test_so_does_a_feature_of_the_user():
    task = rs.IBVS(
        GOAL, features=[rs.features.FeatureBlock(Spread()), rs.features.FeatureBlock("points")]
    )
    run = closed(task, occlusions=rs.imperfections.Occlusion([1], 0.5, 1.0))
    free = closed(task)
    assert np.isfinite(run.s.values).all() and not free.s.equals(run.s)
    kept = run.s.values[13:24, 4:6]  # of mark 1, from the last image that shows it
    np.testing.assert_array_equal(kept, np.repeat(free.s.values[12:13, 4:6], 11, axis=0))
    np.testing.assert_array_equal(free.s.values[:13], run.s.values[:13])


EVERYTHING = rs.Sensing(
    0.5, 0.25, 0.05, 20.0, [rs.imperfections.Occlusion([2], 0.3, 0.7)], 0.2, 0.055, 0.08
)
JOINTS = rs.Actuation(lag=0.05, velocity=0.4, acceleration=2.0)


@pytest.mark.parametrize("task", [TASK, rs.PBVS(GOAL)])
def test_all_at_once_gives_the_same_bits_alone_in_a_batch_in_chunks_and_threads(task):
    starts = np.repeat(Q0[None], 7, axis=0)
    settings = {"duration": 1.0, "sensing": EVERYTHING, "actuation": JOINTS, "seed": 4}
    whole = rs.simulate(SCENE, task, starts, threads=1, **settings)
    same(rs.simulate(SCENE, task, starts, threads=3, chunk=2, **settings), whole)
    for row in (0, 5):
        same(rs.simulate(SCENE, task, starts[row], first_run=row, **settings), whole.isel(run=row))
    assert rs.replay(whole).identical(whole)
    assert whole.attrs["sensing"] == repr(EVERYTHING) and whole.attrs["actuation"] == repr(JOINTS)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: rs.Sensing(noise=-0.5), "noise must be a number (px) not below 0, got -0.5"),
        (lambda: rs.Sensing(noise=np.nan), "Sensing.noise: nan"),
        (lambda: rs.Sensing(noise="0.5 px"), "Sensing.noise: expected a number, got '0.5 px'"),
        (lambda: rs.Sensing(noise=[0.5, 0.5]), "noise must be a number (px) not below 0"),
        (lambda: rs.Sensing(dropped=1.0), "dropped must be a number not below 0 and below 1"),
        (lambda: rs.Sensing(outliers=1.5), "outliers must be a number not below 0 and below 1"),
        (lambda: rs.Sensing(latency=-0.1), "latency must be a number (s) not below 0"),
        (lambda: rs.Sensing(occlusions=[0]), "Sensing.occlusions: expected a"),
        (lambda: rs.Sensing(occlusions=""), "Occlusion, got ''"),
        (lambda: rs.Sensing(occlusions={}), "Occlusion, got {}"),
        (
            lambda: rs.imperfections.Occlusion([0], 0.0),
            "Occlusion.start must be a positive number (s), got 0",
        ),
        (
            lambda: rs.imperfections.Occlusion([0], 2.0, 1.0),
            "an occlusion from 2 s must end later, not 1",
        ),
        (
            lambda: rs.imperfections.Occlusion([], 1.0),
            "Occlusion.marks must have at least 1 item, not 0",
        ),
        (
            lambda: rs.imperfections.Occlusion([0.5], 1.0),
            "Occlusion.marks must be a whole number from 0 to",
        ),
        (
            lambda: rs.imperfections.Occlusion([0], 1.0, target=3),
            "Occlusion.target must be a text, of",
        ),
        (
            lambda: closed(occlusions=rs.imperfections.Occlusion([9], 1.0)),
            "has 4 marks, numbered from 0; there",
        ),
        (
            lambda: closed(occlusions=rs.imperfections.Occlusion([0], 1.0, camera="camra")),
            "the task has no camera 'camra'; did you mean 'camera'?",
        ),
        (lambda: closed(period=0.05), "0.05 s, must be a multiple of the control period, 0.04 s"),
        (lambda: closed(period=0.01), "must be a multiple of the control period"),
    ],
)
def test_contradictory_values_are_refused(made, words):
    with pytest.raises(rs.errors.InputError) as error:
        made()
    assert words in str(error.value)


def test_marks_are_hidden_from_runs_that_differ_as_from_single_ones():
    hidden = rs.Sensing(occlusions=rs.imperfections.Occlusion([1], 0.4, 1.0))
    one = VISP.with_(sensing=hidden, duration=1.6, record="all")
    several = one.vary({"cameras.camera.focal": [800.0, 840.0, 880.0]})
    run = several.run()
    for i in range(3):
        np.testing.assert_array_equal(several.of_run(i).run().qd, run.qd[i])
    seen = one.with_(sensing=rs.Sensing()).vary(several.varied).run()
    assert (run.qd != seen.qd).any(("time", "velocity")).all()
