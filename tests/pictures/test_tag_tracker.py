"""The tracker of a tag against the projected corners, in pictures of a scene."""

import time
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.vision import MarkSearch, Optics, Tag, TagTracker

TAG = Tag("DICT_4X4_50", 3, size=0.1)
K = np.array([[800.0, 2.0, 321.3], [0, 790.0, 238.2], [0, 0, 1]])
LENS = (-0.2, 0.05, 0.001, -0.002)


@pytest.fixture(autouse=True)
def _without_opencv(monkeypatch):
    """Tags with random cells: the cells of the families come from OpenCV."""
    monkeypatch.setattr(Tag, "cells", property(lambda self: draw_cells(self.id)))


def draw_cells(number):
    """Return cells (6, 6) with a black border, and half of the others black."""
    cells = np.ones((6, 6), dtype=bool)
    inner = np.random.default_rng(number).permutation(16).reshape(4, 4)
    cells[1:-1, 1:-1] = inner < 8
    return cells


def take_view(tag, pose=None, optics=None):
    """Return the picture of a tag, and the exact corners."""
    eye = rs.MountedCamera("eye", rs.Camera(K, (640, 480)), optics=optics)
    pose = pose or rs.Pose.at(0.02, -0.01, 0.7, rotvec=(0.3, -0.4, 0.2))
    scene = rs.Scene(objects=rs.Object("tag", tag=tag, pose=pose), cameras=eye)
    return scene.picture(), scene.view(points="tag").pixels


def views(count, lens=(), optics=None, samples=1, seed=3):
    """Yield the picture of a tag at a random pose, and the exact corners."""
    rng = np.random.default_rng(seed)
    eye = rs.MountedCamera("eye", rs.Camera(K, (640, 480), distortion=lens), optics=optics)
    for k in range(count):
        turn = rng.uniform(-0.7, 0.7, 3)
        pose = rs.Pose.at(*rng.uniform(-0.08, 0.08, 2), rng.uniform(0.55, 1.0), rotvec=turn)
        scene = rs.Scene(objects=rs.Object("tag", tag=TAG, pose=pose), cameras=eye)
        yield scene.picture(samples=samples, seed=k), scene.view(points="tag").pixels


def track(picture, last, tag=TAG, **fields):
    camera = rs.Camera(K, (640, 480))
    search = MarkSearch(tag, tag.marks, camera, np.asarray(last)[None])
    return TagTracker(**fields).find(picture[None], search)[0]


@pytest.mark.parametrize(
    ("samples", "lens", "bar"), [(1, (), 0.003), (2, (), 0.003), (1, LENS, 0.012), (2, LENS, 0.012)]
)
@pytest.mark.few(1)
def test_the_corners_have_errors_of_thousandths_of_a_pixel(samples, lens, bar):
    rng, errors = np.random.default_rng(1), []
    for picture, true in views(20 if samples == 1 else 8, lens, samples=samples):
        errors.append(track(picture, true + rng.uniform(-5, 5, 2)) - true)
    assert np.sqrt(np.mean(np.square(errors))) < bar
    assert np.abs(np.mean(errors, axis=(0, 1))).max() < 1e-3


def test_the_deviation_is_that_of_pictures_with_noise():
    optics = Optics(read_noise=2.0)
    errors = [track(picture, np.rint(true)) - true for picture, true in views(20, optics=optics)]
    measured = np.sqrt(np.mean(np.square(errors)))
    assert 0.5 < measured / TagTracker().deviation < 2.0


def test_the_result_does_not_depend_on_the_other_pictures():
    pictures, corners = zip(*views(3), strict=True)
    last = np.rint(corners)
    camera = rs.Camera(K, (640, 480))
    together = TagTracker().find(np.array(pictures), MarkSearch(TAG, TAG.marks, camera, last))
    for picture, before, found in zip(pictures, last, together, strict=True):
        np.testing.assert_array_equal(track(picture, before), found)


def test_a_tag_that_moved_too_far_or_is_cut_or_hidden_is_lost():
    picture, true = next(views(1))
    assert np.isnan(track(picture, true + np.array([40.0, 0.0]))).all()
    assert np.isnan(track(picture, true + np.array([10.0, 0.0]), reach=2.0)).all()
    assert np.isfinite(track(picture, true + np.array([10.0, 0.0]), reach=14.0)).all()
    empty = np.full_like(picture, 128)
    assert np.isnan(track(empty, true)).all()
    top, left = np.floor(true.min(axis=0)).astype(int)[::-1]
    cut = picture[top + 20 :, left + 20 :]
    assert np.isnan(track(cut, true - [left + 20.0, top + 20.0])).all()
    covered = picture.copy()
    covered[:, : int(true[:, 0].mean())] = 225
    assert np.isnan(track(covered, true)).all()
    assert np.isnan(track(picture, np.full((4, 2), np.nan))).all()


def test_another_tag_at_the_last_place_is_not_found():
    """Two tags change their places between two pictures."""
    here, there = (rs.Pose.at(x, 0.0, 0.7, rotvec=(0.2, 0.3, 0.1)) for x in (-0.1, 0.1))
    other = Tag("DICT_4X4_50", 8, size=0.1)
    eye = rs.MountedCamera("eye", rs.Camera(K, (640, 480)))
    scenes = [
        rs.Scene(
            objects=[rs.Object("a", tag=TAG, pose=a), rs.Object("b", tag=other, pose=b)],
            cameras=eye,
        )
        for a, b in ((here, there), (there, here))
    ]
    before = [scenes[0].view(points=name).pixels for name in "ab"]
    after = scenes[1].picture()
    for last, tag, neighbour in zip(before, (TAG, other), (other, TAG), strict=True):
        assert np.isnan(track(after, last, tag)).all()
        np.testing.assert_allclose(track(after, last, neighbour), last, rtol=0, atol=0.02)
        assert np.isfinite(track(after, last, tag, reads_cells=False)).all()


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_turned_tag_is_not_found(quarters):
    """The last places are those of a tag that was turned by quarters."""
    picture, true = take_view(TAG)
    np.testing.assert_allclose(track(picture, true), true, rtol=0, atol=0.02)
    turned = np.roll(true, quarters, axis=0)
    assert np.isnan(track(picture, turned)).all()
    np.testing.assert_allclose(track(picture, turned, reads_cells=False), turned, rtol=0, atol=0.02)


def test_cells_of_a_wrong_colour_count():
    picture, true = take_view(TAG)
    inner = rs.vision.estimate_homography(TAG.marks[:, :2] / TAG.pitch, true)
    spoilt = picture.copy()
    for number, (row, column) in enumerate(((1, 1), (2, 3)), start=1):
        x, y, w = inner @ [column - 2.5, row - 2.5, 1.0]
        j, i = round(y / w), round(x / w)
        spoilt[j - 3 : j + 4, i - 3 : i + 4] = 225 if TAG.cells[row, column] else 30
        assert np.isnan(track(spoilt, true, most_wrong=number - 1)).all()
        np.testing.assert_allclose(track(spoilt, true, most_wrong=number), true, atol=0.02)


def test_reading_the_cells_takes_less_than_the_edges():
    picture, true = take_view(TAG)
    search = MarkSearch(TAG, TAG.marks, rs.Camera(K, (640, 480)), true[None])
    times = {True: [], False: []}
    for reads in (True, False) * 40:
        tracker = TagTracker(reads_cells=reads)
        began = time.thread_time_ns()
        tracker.find(picture[None], search)
        times[reads].append(time.thread_time_ns() - began)
    assert min(times[True]) < 1.5 * min(times[False])


@pytest.mark.full
def test_a_tag_is_tracked_through_a_run():
    """The camera has noise and its exposure; the end is within the noise of the tracker."""
    arm = rs.load_scenario(rs.examples.path("eye_in_hand"))
    plate, eye = arm.scene.object("plate"), arm.scene.camera()
    pose = plate.pose @ rs.Pose.at(0, 0, 0, rpy=(np.pi, 0, 0))
    target = rs.Object("plate", tag=TAG, pose=pose, on=plate.on)
    optics = Optics(read_noise=2.0, full_well=20_000, exposure=0.005)
    eye = replace(eye, camera=eye.camera.resized(400, 400), optics=optics)
    scene = rs.Scene(arm.scene.robots, target, eye)
    start = np.asarray(arm.start) + 0.01 * np.array([1, -1, 1, 0, -1, 1, 0])
    task = rs.IBVS(arm.task.goal, detector="tag_tracker", gain=2.0)
    run = rs.simulate(scene, task, start, duration=5.0)
    exact = rs.simulate(scene, replace(task, detector=None), start, duration=5.0)
    assert float(run.pixel_error) < 0.05
    assert abs(run.error_norm[25] - exact.error_norm[25]) < 0.01 * exact.error_norm[0]


def test_a_small_tag_that_moves_by_more_than_its_cells_is_found_or_lost():
    """Sides of 40 pixels, whose inner edges are near their last places: never a wrong corner."""
    rng, found = np.random.default_rng(5), 0
    eye = rs.MountedCamera("eye", rs.Camera(K, (640, 480)), optics=Optics(read_noise=2.0))
    for seed in range(30):
        turn = rng.uniform(-0.5, 0.5, 3)
        pose = rs.Pose.at(*rng.uniform(-0.2, 0.2, 2), 2.0, rotvec=turn)
        scene = rs.Scene(objects=rs.Object("tag", tag=TAG, pose=pose), cameras=eye)
        angle = rng.uniform(0, 2 * np.pi)
        true = scene.view(points="tag").pixels
        last = true + rng.uniform(4, 12) * np.array([np.cos(angle), np.sin(angle)])
        error = track(scene.picture(seed=seed), last) - true
        found += np.isfinite(error).all()
        assert np.isnan(error).all() or np.abs(error).max() < 0.2
    assert 10 <= found < 30


def test_other_targets_are_refused():
    with pytest.raises(
        rs.errors.InputError, match="TagTracker needs a Tag or Board, and the object"
    ):
        TagTracker().check(None, np.zeros((4, 3)), rs.Camera(K, (640, 480)))
