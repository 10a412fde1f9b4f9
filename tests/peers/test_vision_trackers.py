"""The tracker of tags and boards of real families, against projected corners and OpenCV."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.vision import Board, MarkSearch, Optics, Tag, TagDetector, TagTracker
from robsim.vision.detectors.tag_tracker import INNER_CELLS
from robsim.vision.tags.tag_families import TAG_FAMILIES, black_cells, find_tag_family

K = np.array([[800.0, 2.0, 321.3], [0, 790.0, 238.2], [0, 0, 1]])
LENS = (-0.2, 0.05, 0.001, -0.002)
BOARD = Board("DICT_4X4_50", 5, 4, square=0.05, tag=0.035)
FINE = Board("DICT_5X5_100", 7, 5, square=0.03, tag=0.022)
APRIL = Board("tag36h11", 5, 4, square=0.05, tag=0.035)


def views(board, count, lens=(), optics=None, samples=1, seed=3):
    """Yield the scene of a board at a random pose, its picture, and its visible corners."""
    rng = np.random.default_rng(seed)
    eye = rs.MountedCamera("eye", rs.Camera(K, (640, 480), distortion=lens), optics=optics)
    middle = rs.Pose.at(*board.marks.mean(axis=0)).inv()
    for k in range(count):
        turn = rng.uniform(-0.5, 0.5, 3) * [1, 1, 3]
        pose = rs.Pose.at(*rng.uniform(-0.02, 0.02, 2), rng.uniform(0.4, 0.7), rotvec=turn) @ middle
        scene = rs.Scene(objects=rs.Object("board", board=board, pose=pose), cameras=eye)
        view = scene.view(points="board")
        inside = view.visibility == 0
        yield scene, scene.picture(samples=samples, seed=k), view.pixels, inside


def track(scene, picture, last, tracker=None):
    board = scene.object("board")
    search = MarkSearch(board.board, board.marks, scene.camera().camera, np.asarray(last)[None])
    return (tracker or TagTracker()).find(picture[None], search)[0]


@pytest.mark.parametrize("board", [BOARD, FINE, APRIL], ids=lambda board: board.name)
@pytest.mark.parametrize(
    ("lens", "noise", "samples", "bar"),
    [((), 0.0, 1, 0.003), ((), 2.0, 1, 0.009), ((), 0.0, 2, 0.0015), (LENS, 0.0, 1, 0.009)],
)
def test_corners_of_boards_have_errors_of_thousandths_of_a_pixel(board, lens, noise, samples, bar):
    """Measured for the three boards: at most 0.0023, 0.0067, 0.0010 and 0.0067 px (rms)."""
    optics = Optics(read_noise=noise) if noise else None
    rng, errors = np.random.default_rng(1), []
    for scene, picture, true, inside in views(board, 6, lens, optics, samples):
        found = track(scene, picture, np.rint(true + rng.uniform(-5, 5, 2)))
        errors.append((found - true)[inside])
    errors = np.concatenate(errors)
    assert np.isfinite(errors).all()
    assert np.sqrt(np.mean(np.square(errors))) < bar
    assert np.abs(errors.mean(axis=0)).max() < 2e-3


def test_the_tracker_and_the_detector_agree():
    for scene, picture, true, inside in views(BOARD, 4, samples=2):
        search = MarkSearch(BOARD, BOARD.marks, scene.camera().camera, true[None])
        exact = TagDetector().find(picture[None], search)[0]
        found = track(scene, picture, np.rint(true))
        both = inside & np.isfinite(exact[:, 0])
        assert both.sum() >= 6
        assert np.abs(found - exact)[both].max() < 0.06  # of the detector


def hide_tags(picture, true, numbers, board=BOARD):
    """Return the picture with grey paper on some tags."""
    H = rs.vision.estimate_homography(board.marks[:, :2], true)
    covered, (y, x) = picture.copy(), np.mgrid[: picture.shape[0], : picture.shape[1]]
    back = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(H).T
    X, Y = back[..., 0] / back[..., 2], back[..., 1] / back[..., 2]
    for corners in board.tag_corners[numbers]:
        (left, top), (right, bottom) = corners[0], corners[2]
        covered[(left < X) & (right > X) & (top < Y) & (bottom > Y)] = 128
    return covered


def test_a_corner_is_found_if_one_of_its_tags_is():
    """The first corner is at the tags 0 and 2, the fourth at 1 and 4 (columns of five squares)."""
    scene, picture, true, _ = next(views(BOARD, 1))
    one = track(scene, hide_tags(picture, true, [0]), true)
    np.testing.assert_allclose(one, true, rtol=0, atol=0.02)
    both = track(scene, hide_tags(picture, true, [0, 2]), true)
    missing = np.flatnonzero(np.isnan(both[:, 0]))
    np.testing.assert_array_equal(missing, [0])
    every = track(scene, hide_tags(picture, true, range(10)), true)
    assert np.isnan(every).all()


def test_old_last_places_of_some_corners_do_not_matter():
    scene, picture, true, _ = next(views(BOARD, 1))
    last = np.rint(true)
    last[:4] += [30.0, -25.0]  # the first row was hidden for a while
    np.testing.assert_allclose(track(scene, picture, last), true, rtol=0, atol=0.02)
    last[:4] = np.nan
    np.testing.assert_allclose(track(scene, picture, last), true, rtol=0, atol=0.02)


def test_a_board_with_other_tags_or_a_turned_board_is_not_found():
    scene, picture, true, _ = next(views(BOARD, 1))
    turned = true[::-1]
    assert np.isnan(track(scene, picture, turned)).all()
    other = scene.replacing(
        scene.object("board").revised(board=replace(BOARD, family="DICT_4X4_100"))
    )
    np.testing.assert_allclose(track(other, picture, true), true, rtol=0, atol=0.02)  # same tags
    other = scene.replacing(
        scene.object("board").revised(board=replace(BOARD, family="DICT_ARUCO_ORIGINAL"))
    )
    assert np.isnan(track(other, picture, true)).all()


def test_the_result_does_not_depend_on_the_other_pictures():
    each = list(views(BOARD, 3))
    camera, last = each[0][0].camera().camera, np.rint([true for _, _, true, _ in each])
    pictures = np.array([picture for _, picture, _, _ in each])
    together = TagTracker().find(pictures, MarkSearch(BOARD, BOARD.marks, camera, last))
    for (scene, picture, _, _), places, found in zip(each, last, together, strict=True):
        np.testing.assert_array_equal(track(scene, picture, places), found)


def test_a_lost_board_is_searched_by_the_detector():
    scene, picture, true, _ = next(views(BOARD, 1))
    far = true + np.array([60.0, 0.0])
    assert np.isnan(track(scene, picture, far)).all()
    found = track(scene, picture, far, TagTracker(search_every=1))
    np.testing.assert_allclose(found, true, rtol=0, atol=0.06)


def test_a_board_leads_a_camera_to_the_goal():
    drone = rs.robots.free_camera()
    camera = rs.Camera([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]], (640, 480))
    optics = Optics(read_noise=2.0, full_well=20_000)
    eye = rs.MountedCamera("eye", camera, on=f"{drone.name}.body", optics=optics)
    board = rs.Object("board", board=BOARD, pose=rs.Pose.at(-0.12, -0.1, 0))
    task = rs.IBVS(rs.GoalPose(rs.Pose.at(0, 0, 0.4)), detector="tag_tracker", gain=3.0)
    start = [0.05, -0.04, -0.6, 0.05, -0.05, 0.1, np.sqrt(0.985)]
    run = rs.simulate(rs.Scene(drone, board, eye), task, start, duration=3.0)
    assert float(run.pixel_error) < 0.15


@pytest.mark.parametrize(
    "family", ["tag16h5", "tag25h9", "tag36h11", "DICT_4X4_50", "DICT_6X6_250"]
)
def test_tags_of_all_families_are_read(family):
    tag, other = Tag(family, 3, size=0.1), Tag(family, 4, size=0.1)
    pose = rs.Pose.at(0.02, -0.01, 0.6, rotvec=(0.3, -0.4, 0.2))
    eye = rs.MountedCamera("eye", rs.Camera(K, (640, 480), distortion=LENS))
    scene = rs.Scene(objects=rs.Object("tag", tag=tag, pose=pose), cameras=eye)
    picture, true = scene.picture(), scene.view(points="tag").pixels

    def find(target, last):
        search = MarkSearch(target, target.marks, eye.camera, last[None])
        return TagTracker().find(picture[None], search)[0]

    np.testing.assert_allclose(find(tag, np.rint(true)), true, rtol=0, atol=0.03)
    assert np.isnan(find(other, true)).all()
    for quarters in (1, 2, 3):
        assert np.isnan(find(tag, np.roll(true, quarters, axis=0))).all()


@pytest.mark.parametrize("family", sorted(set(TAG_FAMILIES) - {"DICT_ARUCO_ORIGINAL"}))
def test_tags_differ_by_more_cells_than_may_be_wrong(family):
    """Two tags of a family, or a tag and its turns; some tags of the original ArUco are equal."""
    ids = range(find_tag_family(family).ids)
    inner = np.stack([black_cells(family, k)[1:-1, 1:-1] for k in ids])
    flat = inner.reshape(len(inner), -1).astype(float)
    for quarters in range(4):
        turned = np.rot90(inner, quarters, axes=(1, 2)).reshape(flat.shape).astype(float)
        apart = flat @ (1 - turned).T + (1 - flat) @ turned.T
        if quarters == 0:
            np.fill_diagonal(apart, np.inf)
        assert apart.min() > flat.shape[1] // INNER_CELLS


@pytest.mark.parametrize(
    ("board", "told"),
    [
        (Board("DICT_4X4_50", 3, 2, 0.05, 0.035), "a board of 3 x 3 squares or more"),
        (Board("DICT_4X4_50", 4, 4, 0.05, 0.045), "0.6 white cells or more .* which has 0.33"),
    ],
)
def test_boards_that_cannot_be_followed_are_refused(board, told):
    with pytest.raises(rs.errors.InputError, match=told):
        TagTracker().check(board, board.marks, rs.Camera(K, (640, 480)))
