"""Marks that a task detects in the pictures of its cameras while it runs."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from PIL import Image

import robsim as rs
from robsim.engine.picture_taking import compute_picture_hash
from robsim.plot.film.camera_frames import CameraFrames
from robsim.plot.film.film_source import build_film_source
from robsim.plot.film.frame_times import choose_frame_times
from robsim.shapes import Light
from robsim.vision import DotDetector, DotPattern, MarkDetector, Optics
from robsim.world.scene_picture import CameraPictures, NoiseKey

POINTS = [[-0.06, -0.06], [0.06, -0.06], [0.06, 0.06], [-0.06, 0.06], [0.0, 0.02]]
DT = 0.04


@pytest.fixture(scope="module")
def experiment():
    """An arm with a camera of 160 x 160 pixels above a pattern of dots."""
    arm = rs.load_scenario(rs.examples.path("eye_in_hand"))
    plate, eye = arm.scene.object("plate"), arm.scene.camera()
    dots = DotPattern(POINTS, radius=0.02)
    pose = plate.pose @ rs.Pose.at(0, 0, 0, rpy=(np.pi, 0, 0))
    target = rs.Object("plate", dots=dots, pose=pose, on=plate.on)
    lens = eye.camera.resized(160, 160)
    scene = rs.Scene(arm.scene.robots, target, replace(eye, camera=lens))
    task = rs.IBVS(arm.task.goal, detector="dots", gain=2.0)
    start = np.asarray(arm.start) + 0.01 * np.array([1, -1, 1, 0, -1, 1, 0])
    return rs.Experiment(scene, task, start, duration=0.6, dt=DT)


def change(experiment, optics=None, **sensing):
    """Return an experiment with other optics and sensing."""
    eye = replace(experiment.scene.camera(), optics=optics)
    scene = experiment.scene.replacing(eye)
    return experiment.with_(scene=scene, sensing=rs.Sensing(**sensing))


def take_pictures(experiment, q, before=None, step=0):
    """Return the picture at coordinates q, one period after the coordinates `before`."""
    scene = experiment.scene
    before = q if before is None else before
    key = NoiseKey(experiment.seed, np.zeros(1, np.uint64), step)
    pictures = CameraPictures(scene, scene.camera())
    return pictures.take(q[:, None], (q - before)[:, None] / DT, key)[0]


def assert_same(one, other, run=None):
    """Assert that two records have the same bits."""
    for name, values in one.data_vars.items():
        theirs = other[name]
        theirs = theirs.isel(run=run) if run is not None and "run" in theirs.dims else theirs
        np.testing.assert_array_equal(values.values, theirs.values, err_msg=name)


def test_detected_dots_lead_to_the_goal(experiment):
    run = experiment.run(duration=5.0)
    exact = experiment.with_(task=replace(experiment.task, detector=None)).run(duration=5.0)
    assert float(exact.pixel_error) < 0.02
    assert float(run.pixel_error) < 0.05
    measured = run.s.values[-1]
    assert np.abs(measured - run.s_goal.values).max() < 1e-3


def test_the_features_are_those_of_the_picture_of_each_instant(experiment):
    run = experiment.run()
    for k in (0, 5, 14):
        picture = experiment.scene.picture(run.q.values[k])
        assert run.picture_hash.values[k, 0] == compute_picture_hash(picture)
        found = experiment.task.detector.find(
            picture[None],
            rs.vision.MarkSearch(None, np.zeros((5, 3)), None, np.rint(run.pixels.values[None, k])),
        )
        K = experiment.scene.camera().camera.K
        s = ((found[0] - K[:2, 2]) / np.diag(K)[:2]).ravel()
        np.testing.assert_allclose(run.s.values[k], s, rtol=0, atol=1e-12)
    assert list(run.picture_camera.values) == ["camera"]


@pytest.mark.full
@pytest.mark.parametrize("sensing", [{}, {"latency": 0.07, "dropped": 0.3}])
def test_bits_are_the_same_alone_in_chunks_and_threads(experiment, sensing):
    optics = Optics(read_noise=2.0, full_well=9000, exposure=0.01, readout=0.01)
    shift = 0.005 * np.arange(4)[:, None] * np.ones(7)
    many = change(experiment, optics, **sensing).with_(start=experiment.start + shift, seed=5)
    run = many.run(duration=0.3, threads=1)
    assert_same(run, many.run(duration=0.3, threads=3, chunk=1))
    alone = many.of_run(2).run(duration=0.3)
    assert_same(alone, run, 2)
    assert_same(alone, rs.Experiment.of(alone).run())


def test_a_late_picture_is_that_of_an_earlier_pose(experiment):
    run = change(experiment, latency=2 * DT).run()
    for k, shown in ((1, 0), (2, 0), (3, 1), (9, 7)):
        picture = experiment.scene.picture(run.q.values[shown])
        assert run.picture_hash.values[k, 0] == compute_picture_hash(picture)


def test_a_picture_between_two_periods_is_that_of_the_pose_between_them(experiment):
    run = change(experiment, latency=1.25 * DT).run()
    between = 0.25 * run.q.values[6] + 0.75 * run.q.values[7]
    found = run.s.values[8]
    picture = experiment.scene.picture(between)
    places = np.rint(run.pixels.values[None, 7])
    marks = rs.vision.MarkSearch(None, np.zeros((5, 3)), None, places)
    pixels = experiment.task.detector.find(picture[None], marks)[0]
    K = experiment.scene.camera().camera.K
    np.testing.assert_allclose(
        found, ((pixels - K[:2, 2]) / np.diag(K)[:2]).ravel(), rtol=0, atol=1e-5
    )


def test_the_noise_of_the_sensing_is_added_to_detected_marks(experiment):
    run = change(experiment, noise=0.5).run(duration=2.0)
    K = experiment.scene.camera().camera.K
    measured = run.s.values.reshape(-1, 5, 2) * np.diag(K)[:2] + K[:2, 2]
    errors = measured - run.pixels.values
    assert run.outcome != rs.Outcome.UNDETECTED
    assert np.std(errors) == pytest.approx(0.5, rel=0.1)  # of 510 values


def test_rare_and_lost_pictures_are_not_drawn(experiment):
    rare = change(experiment, period=3 * DT).run().picture_hash.values[:, 0]
    assert (rare[0:3] == rare[0]).all()
    assert (rare[3:6] == rare[3]).all()
    assert rare[3] != rare[0]
    lossy = change(experiment, dropped=0.5).with_(seed=2).run()
    kept = np.flatnonzero(np.diff(lossy.picture_hash.values[:, 0]) == 0)
    assert 3 <= len(kept) <= 12
    same = np.abs(np.diff(lossy.s.values, axis=0)).max(axis=1) == 0
    np.testing.assert_array_equal(np.flatnonzero(same), kept)


def test_motion_blurs_the_pictures_of_a_run(experiment):
    optics = Optics(exposure=0.03, read_noise=1.0)
    moving = change(experiment, optics)
    run = moving.run()
    for k in (0, 4):
        q = run.q.values
        expected = take_pictures(moving, q[k], q[max(k - 1, 0)], step=k)
        assert run.picture_hash.values[k, 0] == compute_picture_hash(expected)
    sharp = moving.scene.picture(run.q.values[4])
    assert run.picture_hash.values[4, 0] != compute_picture_hash(sharp)


def test_a_start_without_detected_marks_ends_with_its_reason(experiment):
    blurred = change(experiment, Optics(defocus=12.0))
    run = blurred.run()
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.UNDETECTED
    assert float(run.end_time) == 0.0
    sentences = str(rs.explain(run))
    assert "in none of them without the blur of the lens (defocus = 12)" in sentences


def test_the_back_of_a_printed_target_is_named(experiment):
    plate = experiment.scene.object("plate")
    pose = plate.pose @ rs.Pose.at(0, 0, 0, rpy=(np.pi, 0, 0))
    run = experiment.with_(scene=experiment.scene.replacing(replace(plate, pose=pose))).run()
    assert run.outcome == rs.Outcome.UNDETECTED
    assert "The camera sees its back; the print is on the side of -z" in str(rs.explain(run))


def test_marks_that_are_not_found_are_not_used(experiment):
    """A second object hides a dot from the tenth instant on: the four others lead the arm."""
    cover = rs.Object(
        "cover", rs.shapes.Block(0.05, 0.05, 0.002), pose=rs.Pose.at(0, 0.02, -0.003), on="plate"
    )
    scene = rs.Scene(
        experiment.scene.robots, [*experiment.scene.objects, cover], experiment.scene.cameras
    )
    task = replace(experiment.task, target="plate", weighting="border")
    run = experiment.with_(scene=scene, task=task).run(duration=4.0)
    weights = run.weight.values[-1].reshape(5, 2)
    np.testing.assert_array_equal(weights[4], 0.0)
    assert (weights[:4] > 0).all()
    assert float(run.pixel_error) < 0.2


@pytest.mark.full
def test_the_advice_takes_the_noise_of_the_detector(experiment):
    exact = rs.advise(experiment.with_(task=replace(experiment.task, detector=None)))
    noisy = rs.advise(
        change(experiment, noise=DotDetector().deviation).with_(task=exact_task(experiment))
    )
    assert exact.noise.pixels == 0.0
    assert rs.advise(experiment).noise.pixels == noisy.noise.pixels > 0.0


def exact_task(experiment):
    return replace(experiment.task, detector=None)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"size": None}, "needs the size of the camera|has no size, which a picture needs"),
        (
            {"optics": Optics(exposure=0.03, readout=0.02)},
            "take 0.05 s; at most the control period",
        ),
    ],
)
def test_impossible_pictures_are_refused_before_the_run(experiment, changes, message):
    eye = experiment.scene.camera()
    if "size" in changes:
        eye = replace(eye, camera=replace(eye.camera, size=None))
    else:
        eye = replace(eye, **changes)
    with pytest.raises(rs.errors.InputError, match=message):
        experiment.with_(scene=experiment.scene.replacing(eye)).run()


def test_tasks_that_share_a_picture_need_one_detector(experiment):
    tasks = [experiment.task, replace(exact_task(experiment), features="point_moments")]
    both = experiment.with_(task=rs.tasks.Priorities(tasks))
    with pytest.raises(rs.errors.InputError, match="detect 'plate' in camera 'camera' in two ways"):
        both.run()


def test_an_experiment_with_a_detector_has_a_text(experiment):
    detector = DotDetector(reach=12.0)
    one = experiment.with_(task=replace(experiment.task, detector=detector))
    text = one.to_toml()
    assert 'detector = {kind = "dots", reach' in text.replace("{ kind", "{kind")
    assert rs.Experiment.from_text(text).task.detector == detector


def test_the_exposure_of_a_flying_camera_keeps_its_pose_rigid():
    """A picture over an exposure is the mean of pictures at poses on the way, also for turns."""
    drone = rs.robots.free_camera()
    optics = Optics(exposure=0.04)
    lens = rs.Camera([[200, 0, 79.5], [0, 200, 59.5], [0, 0, 1]], (160, 120))
    eye = rs.MountedCamera("eye", lens, on=f"{drone.name}.body", optics=optics)
    dots = DotPattern.grid(3, 2, spacing=0.1, radius=0.03)
    scene = rs.Scene(drone, rs.Object("dots", dots=dots, pose=rs.Pose.at(0, 0, 0.5)), eye)
    angle = 0.4  # radians about the optical axis within the exposure
    q = np.array([0, 0, 0, 0, 0, np.sin(angle / 2), np.cos(angle / 2)])
    before = np.array([0, 0, 0, 0, 0, 0, 1.0])
    key = NoiseKey(0, np.zeros(1, np.uint64), 0)
    taken = CameraPictures(scene, eye).take(q[:, None], ((q - before) / 0.04)[:, None], key)[0]
    clean = scene.replacing(replace(eye, optics=None))
    shares = 1 - (np.arange(8) + 0.5) / 8
    turns = [rs.Pose.at(0, 0, 0, rotvec=[0, 0, share * angle]).quaternion for share in shares]
    mean = np.mean([clean.picture([0, 0, 0, *turn], exact=True) for turn in turns], axis=0)
    assert np.abs(taken - mean).mean() < 1.0
    assert np.abs(taken - clean.picture(q, exact=True)).mean() > 5.0


def test_figures_show_the_picture_and_its_difference_from_the_goal(experiment):
    run, scene = experiment.run(), experiment.scene
    end = scene.picture(run.q_end.values, exact=True)
    goal = scene.picture(scene.home, exact=True)
    expected = {"end": end, "difference": 127 + 0.5 * (end - goal)}
    for which, grey in expected.items():
        (drawn,) = rs.plot.image(run, scene=scene, picture=which).axes[0].get_images()
        shown = drawn.get_array().astype(float)
        # the arm is at the end of the run in the picture of the goal
        assert np.mean(np.abs(shown - np.clip(np.rint(grey), 0, 255)) > 1) < 0.15
        assert list(drawn.get_extent()) == [-0.5, 159.5, 159.5, -0.5]
    same = rs.plot.image(run, scene=scene, picture="end").axes[0].get_images()[0].get_array()
    np.testing.assert_array_equal(same, np.rint(np.clip(end, 0, 255)).astype(np.uint8))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"picture": "goal"}, "no 'goal'|pictures"),
        ({"picture": "end"}, "needs the scene of the run"),
    ],
)
def test_figures_refuse_other_pictures(experiment, arguments, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.plot.image(experiment.run(duration=0.1), **arguments)


def test_a_film_of_the_camera_shows_the_pictures_of_the_run(experiment, tmp_path):
    moving = change(experiment, Optics(exposure=0.02, read_noise=2.0, full_well=9000)).with_(seed=4)
    run = moving.run()
    source = build_film_source(run)
    frames = CameraFrames(source, choose_frame_times(source.time, 25.0, 1.0), "camera")
    assert len(frames) == run.sizes["time"]
    for k in (0, 1, 9):
        picture = frames.draw_picture(k)
        assert compute_picture_hash(picture) == run.picture_hash.values[k, 0]
        np.testing.assert_array_equal(frames[k][..., 1], picture)
    path = rs.plot.save_film(run, tmp_path / "eye.gif", camera="camera", fps=5)
    with Image.open(path) as film:
        film.seek(film.n_frames - 1)
        last = np.asarray(film.convert("L"), dtype=float)
    assert np.abs(last - frames.draw_picture(len(frames) - 1)).mean() < 4.0
    with pytest.raises(rs.errors.InputError, match="no camera 'eye'"):
        rs.plot.save_film(run, tmp_path / "eye.gif", camera="eye")


def test_wrong_results_of_an_own_detector_are_named(experiment):
    @dataclass(frozen=True)
    class Half(MarkDetector):
        def find(self, pictures, search):
            return search.last[:, :2]

    with pytest.raises(rs.errors.InputError, match=r"Half\.find: expected .*5, 2"):
        experiment.with_(task=replace(experiment.task, detector=Half())).run()


def test_a_detector_knows_the_belief_of_the_task_only(experiment):
    known = []

    @dataclass(frozen=True)
    class Curious(MarkDetector):
        def find(self, pictures, search):
            known.extend([(search.camera.K[0, 0], search.marks[0, 0])] * len(pictures))
            return search.last

    true = experiment.scene.camera().camera.K[0, 0]
    belief = experiment.scene.believe(focal=1.25, size=0.5)
    task = replace(experiment.task, detector=Curious(), belief=belief)
    one = experiment.with_(task=task, duration=0.08)
    one.run()
    assert set(known) == {(1.25 * true, 0.5 * POINTS[0][0])}
    known.clear()
    focal = [[1.1 * true] * 2, [1.2 * true] * 2]
    one.vary({"belief.cameras.camera.focal": focal}).run(threads=1)
    assert {number for number, _ in known} == {1.1 * true, 1.2 * true}


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("cameras.camera.focal", [[50.0, 50.0], [53.0, 52.0]]),
        ("cameras.camera.optics.read_noise", [1.0, 3.0]),
    ],
)
def test_numbers_that_differ_from_run_to_run_are_in_the_pictures(experiment, name, values):
    many = change(experiment, Optics(read_noise=2.0)).vary({name: values})
    run = many.run(duration=0.2)
    assert run.picture_hash.values[0, 0, 0] != run.picture_hash.values[1, 0, 0]
    for k in (0, 1):
        assert_same(many.of_run(k).run(duration=0.2)[["picture_hash", "s"]], run, k)


@pytest.mark.parametrize(
    "change",
    [{"light": Light((0.0, 0.5, -1.0), ambient=0.1)}, {"background": 120.0}, {"samples": 2}],
    ids=str,
)
def test_light_background_and_samples_act_in_the_pictures_of_a_run(experiment, change, tmp_path):
    scene, plain = experiment.scene, experiment.run(duration=0.2)
    place, cube = rs.Pose.at(0.12, 0.0, 0), rs.Block(0.06, 0.06, 0.06)
    block = rs.Object("block", cube, np.empty((0, 3)), place, on="plate")
    scene = replace(scene, objects=(*scene.objects, block))
    if "samples" in change:
        changed = scene.replacing(replace(scene.camera(), optics=Optics(**change)))
    else:
        changed = replace(scene, **change)
    other = experiment.with_(scene=changed, duration=0.2, title="other")
    run = other.run()
    assert (run.picture_hash.values != plain.picture_hash.values).all()
    for k in (0, 5):
        q = run.q.values[k]
        assert run.picture_hash.values[k, 0] == compute_picture_hash(changed.picture(q))
        np.testing.assert_array_equal(scene.picture(q, **change), changed.picture(q))
        assert (scene.picture(q) != changed.picture(q)).any()
        same = changed.picture(q, samples=1, light=scene.light, background=50)
        np.testing.assert_array_equal(same, scene.picture(q))
    source = build_film_source(run)
    frames = CameraFrames(source, choose_frame_times(source.time, 4.0, 1.0), "camera")
    k = int(frames.clock.instants[-1])
    picture = frames.draw_picture(k)
    np.testing.assert_array_equal(picture, changed.picture(run.q.values[k]))
    for text in (other.to_toml(folder=tmp_path), other.to_toml(complete=True)):
        again = rs.Experiment.from_text(text)
        assert again == other and again.hash == other.hash
    assert rs.replay(run).identical(run)


def test_a_belief_has_no_light_of_its_own(experiment):
    dark = replace(experiment.scene, light=Light(ambient=0.0))
    lit = experiment.with_(scene=dark)
    assert lit.with_(task=replace(lit.task, belief=experiment.scene)).loop() is not None
    believing = experiment.with_(task=replace(experiment.task, belief=dark))
    with pytest.raises(rs.errors.InputError, match="light: a controller does not use it"):
        believing.loop()
