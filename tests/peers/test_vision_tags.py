"""Tags and boards that are drawn and rendered, and found again by AprilTag and OpenCV."""

import cv2
import numpy as np
import pytest

import robsim as rs
from robsim.vision.tags.detector_backends import make_tag_finder
from robsim.vision.tags.tag_families import TAG_FAMILIES, opencv_dictionary

CAMERA = rs.Camera(
    [[300, 0, 160.3], [0, 302, 119.8], [0, 0, 1]], (320, 240), distortion=(-0.2, 0.05, 1e-3, 2e-4)
)
KINDS = ["tag16h5", "tag25h9", "tag36h11", "DICT_4X4_50", "DICT_6X6_250", "DICT_ARUCO_ORIGINAL"]
BOARD = rs.vision.Board("DICT_4X4_100", columns=5, rows=4, square=0.03, tag=0.022)


def tilted(rng, depth):
    place = rng.uniform(-0.1, 0.1, 2) * depth
    return rs.Pose.at(*place, depth, rotvec=rng.uniform(-1, 1, 3) * [0.5, 0.5, 3])


def rms(errors):
    return float(np.sqrt(np.mean(np.square(errors))))


def noisy(image, rng):
    blurred = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0, 2, image.shape)
    return np.clip(np.round(blurred), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("name", TAG_FAMILIES)
def test_a_family_agrees_with_opencv(name):
    theirs = opencv_dictionary(name)
    assert TAG_FAMILIES[name].ids == len(theirs.bytesList)
    assert TAG_FAMILIES[name].cells == theirs.markerSize + 2


@pytest.mark.parametrize("family", KINDS)
def test_the_corners_of_an_upright_picture_are_where_its_edges_are(family):
    """From the upper left clockwise; an edge lies between two pixels, at a half."""
    tag = rs.vision.Tag(family, 7, size=0.1)
    picture = np.pad(tag.picture(10), 20, constant_values=255)
    low, high = 29.5, 29.5 + 10 * len(tag.cells)
    seen = rs.vision.TagDetector([tag])(picture)
    wanted = [[low, low], [high, low], [high, high], [low, high]]
    np.testing.assert_allclose(seen[tag.name], wanted, rtol=0, atol=1e-9)
    assert seen.doubtful == {}


@pytest.mark.parametrize("family", [name for name in KINDS if name.startswith("tag")])
def test_apriltag_counts_pixels_from_the_corner_of_the_image(family):
    """Half a pixel more than we do, which our finder takes off; else upright as it prints it."""
    from pyapriltags import Detector

    tag = rs.vision.Tag(family, 5, size=0.1)
    picture = np.pad(tag.picture(10), 20, constant_values=255)
    (theirs,) = Detector(family, quad_decimate=1.0).detect(picture)
    low, high = 30, 30 + 10 * len(tag.cells)
    wanted = [[low, high], [high, high], [high, low], [low, low]]  # from the lower left
    np.testing.assert_allclose(theirs.corners, wanted, rtol=0, atol=0.02)
    ((number, ours),) = make_tag_finder(family)(picture)
    np.testing.assert_allclose(ours, theirs.corners[::-1] - 0.5, rtol=0, atol=1e-12)
    assert number == 5


@pytest.mark.parametrize("family", KINDS)
def test_rendered_tags_are_found_to_a_hundredth_of_a_pixel(family):
    """Through a lens; of sides from 35 to 130 pixels; at most 0.015 px rms with blur and noise."""
    rng = np.random.default_rng(3)
    tag = rs.vision.Tag(family, 9, size=0.1)
    detector = rs.vision.TagDetector([tag])
    clean, rough = [], []
    for depth in (0.3, 0.4, 0.5, 0.6, 0.75):
        T_c_o = tilted(rng, depth)
        image = rs.vision.render_targets(CAMERA, {tag: T_c_o}, samples=6)
        wanted = CAMERA.project(T_c_o @ tag.marks, rs.Pose.at())
        clean.append(detector(image)[tag.name] - wanted)
        rough.append(detector(noisy(image, rng))[tag.name] - wanted)
    assert rms(clean) < 0.01 and rms(rough) < 0.015
    assert np.abs(np.mean(clean, axis=(0, 1))).max() < 0.005  # no half pixel, nor a tenth


EYE = rs.Camera([[300, 0, 240.3], [0, 302, 199.8], [0, 0, 1]], (480, 400))


def sampled(tag, T_c_o, count=12):
    """Return the image of a tag with the mean of count x count rays of each pixel around it."""
    image = np.full((400, 480), 128.0)
    outline = EYE.project(T_c_o @ (1.4 * tag.marks), rs.Pose.at())
    (u, v), (right, down) = np.floor(outline.min(axis=0)).astype(int), outline.max(axis=0)
    steps = (np.arange(count) + 0.5) / count - 0.5
    x, y = (
        (first + np.arange(int(last) - first + 2))[:, None] + steps
        for first, last in ((u, right), (v, down))
    )
    pixels = np.stack(np.meshgrid(x.ravel(), y.ravel()), axis=-1)
    rays = np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=-1) @ np.linalg.inv(EYE.K).T
    R, t = T_c_o.rotation, T_c_o.position
    points = (rays * (R[:, 2] @ t / (rays @ R[:, 2]))[..., None] - t) @ R
    black, half = tag.is_black(points[..., 0], points[..., 1]), tag.size / 2 + tag.pitch
    grey = np.where(black, 30.0, 225.0)
    grey[np.abs(points[..., :2]).max(axis=-1) > half] = 128
    patch = grey.reshape(len(y), count, len(x), count).mean(axis=(1, 3))
    image[v : v + len(y), u : u + len(x)] = patch
    return image


@pytest.fixture(scope="module")
def views():
    """Sixteen views of a tag with sides of 28 to 110 pixels, and the pixels of its corners."""
    tag, rng = rs.vision.Tag("tag36h11", 7, size=0.1), np.random.default_rng(0)
    poses = [tilted(rng, depth) for depth in rng.uniform(0.27, 1.05, 16)]
    return tag, [(T, sampled(tag, T), EYE.project(T @ tag.marks, rs.Pose.at())) for T in poses]


@pytest.mark.parametrize(
    "blur, noise, most",
    [
        (0, 0, 0.003),
        (0, 2, 0.008),
        (0.7, 0, 0.005),
        (0.7, 2, 0.0135),
        (1, 2, 0.023),
        (1.5, 0, 0.075),
        (1.5, 2, 0.08),
        (2, 2, 0.19),
    ],
)
def test_corners_are_better_than_those_of_pyapriltags(views, blur, noise, most):
    tag, shots = views
    find, detector = make_tag_finder(tag.family), rs.vision.TagDetector([tag])
    rng, raw, ours = np.random.default_rng(5), [], []
    for _, sharp, wanted in shots:
        grey = cv2.GaussianBlur(sharp, (0, 0), blur) if blur else sharp
        grey = np.round(grey + rng.normal(0, 1, grey.shape) * noise)
        image = np.clip(grey, 0, 255).astype(np.uint8)
        seen = detector(image)
        for number, corners in find(image):
            assert number == tag.id
            raw.append(corners - wanted)
            ours.append(seen[tag.name] - wanted)
    assert len(raw) == len(shots)
    assert rms(ours) < most and rms(ours) < 0.9 * rms(raw)
    assert np.abs(ours).max() < max(np.abs(raw).max(), 0.02)


def test_the_pose_of_a_rendered_tag_is_found():
    tag = rs.vision.Tag("tag36h11", 3, size=0.1)
    T_c_o = rs.Pose.at(0.02, -0.03, 0.4, rotvec=(0.5, -0.3, 0.4))
    seen = rs.vision.TagDetector([tag])(rs.vision.render_targets(CAMERA, {tag: T_c_o}))
    found = rs.vision.estimate_pose(tag.marks, seen[tag.name], CAMERA).T_c_o
    error = (rs.Pose(found).inv() @ T_c_o).matrix - np.eye(4)
    assert np.abs(error[:3, 3]).max() < 5e-4 and np.abs(error[:3, :3]).max() < 5e-3


@pytest.mark.parametrize("rows", [4, 5])
def test_a_board_is_drawn_as_opencv_draws_it(rows):
    board = rs.vision.Board("DICT_4X4_100", columns=5, rows=rows, square=0.03, tag=0.018)
    theirs = board.as_opencv().generateImage((500, 100 * rows), marginSize=0, borderBits=1)
    ours = board.picture(100)[50:-50, 50:-50]
    assert theirs.shape == ours.shape and np.mean(theirs != ours) < 1e-3
    np.testing.assert_allclose(
        board.as_opencv().getChessboardCorners(), board.marks, rtol=0, atol=1e-7
    )


def test_the_corners_of_a_rendered_board_are_found():
    rng = np.random.default_rng(1)
    detector = rs.vision.TagDetector([BOARD])
    middle = rs.Pose.at(-0.075, -0.06)
    errors = []
    for depth in (0.2, 0.25, 0.3):
        T_c_o = tilted(rng, depth) @ middle
        seen = detector(rs.vision.render_targets(CAMERA, {BOARD: T_c_o}))
        errors.append(seen[BOARD.name] - CAMERA.project(T_c_o @ BOARD.marks, rs.Pose.at()))
    assert np.isfinite(errors).mean() > 0.8
    assert np.sqrt(np.nanmean(np.square(errors))) < 0.05


def test_a_covered_board_has_gaps_that_a_pose_estimate_takes():
    T_c_o = rs.Pose.at(-0.075, -0.06, 0.25, rotvec=(0.2, 0.3, 0.1))
    image = rs.vision.render_targets(CAMERA, {BOARD: T_c_o})
    image[:, :115] = 128
    pixels = rs.vision.TagDetector([BOARD])(image)[BOARD.name]
    gone = np.isnan(pixels[:, 0])
    assert 0 < gone.sum() < len(pixels) and gone.reshape(3, 4)[:, 0].all()
    found = rs.vision.estimate_pose(BOARD.marks[~gone], pixels[~gone], CAMERA).T_c_o
    np.testing.assert_allclose(found[:3, 3], T_c_o.position, rtol=0, atol=2e-3)


def two_tags():
    pair = rs.vision.Tag("tag36h11", 1, size=0.04), rs.vision.Tag("DICT_5X5_100", 2, size=0.04)
    places = [rs.Pose.at(x, 0, 0.25) for x in (-0.05, 0.05)]
    return pair, dict(zip(pair, places, strict=True))


def test_an_unseen_tag_is_absent_and_its_pixels_are_gaps():
    (april, aruco), placed = two_tags()
    away = rs.vision.Tag("tag36h11", 2, size=0.04)
    seen = rs.vision.TagDetector([april, away, aruco])(rs.vision.render_targets(CAMERA, placed))
    assert sorted(seen) == sorted([april.name, aruco.name]) and seen.doubtful == {}
    pixels = seen.pixels([aruco, away, april])
    assert pixels.shape == (12, 2) and np.isnan(pixels[4:8]).all()
    np.testing.assert_array_equal(pixels[8:], seen[april.name])


@pytest.mark.parametrize("family", ["tag36h11", "DICT_5X5_100"])
def test_a_tag_that_is_seen_twice_is_reported_and_not_delivered(family):
    tag = rs.vision.Tag(family, 4, size=0.04)
    image = rs.vision.render_targets(CAMERA, {tag: rs.Pose.at(-0.05, 0, 0.25)})
    both = np.hstack([image[:, :160], image[:, :160]])
    seen = rs.vision.TagDetector([tag])(both)
    assert dict(seen) == {} and seen.doubtful == {tag.name: "seen 2 times"}


def test_doubtful_tags_are_flagged():
    tag = rs.vision.Tag("tag36h11", 4, size=0.04)
    detector = rs.vision.TagDetector([tag])

    def told(image):
        seen = detector(image)
        assert tag.name in seen
        return seen.doubtful.get(tag.name)

    near = rs.vision.render_targets(CAMERA, {tag: rs.Pose.at(0, 0, 0.25)})
    assert told(near) is None
    spot = near.copy()
    u, v = CAMERA.project([[0, 0, 0.25]], rs.Pose.at())[0].astype(int)
    spot[v - 7 : v - 1, u - 7 : u - 1] = np.where(near[v - 4, u - 4] > 128, 30, 225)
    assert told(spot) == "1 of 64 cells do not match"
    assert told((110 + near / 15).astype(np.uint8)) == "a contrast of 13 grey values"
    assert told(rs.vision.render_targets(CAMERA, {tag: rs.Pose.at(0, 0, 0.6)})).startswith(
        "cells of 2."
    )
    edge = rs.vision.render_targets(CAMERA, {tag: rs.Pose.at(0, 0, 0.25)})[: v + 26]
    assert told(edge).endswith("at the border of the image")


def test_the_nearer_of_two_targets_is_in_front():
    (april, aruco), _ = two_tags()
    placed = {april: rs.Pose.at(0, 0, 0.25), aruco: rs.Pose.at(0.01, 0, 0.24)}
    image = rs.vision.render_targets(CAMERA, placed)
    assert list(rs.vision.TagDetector([april, aruco])(image)) == [aruco.name]
    assert np.array_equal(image, rs.vision.render_targets(CAMERA, dict(reversed(placed.items()))))


def test_the_grey_of_a_pixel_is_the_share_of_paper_in_it():
    """An edge of the paper that is known exactly, in front of a plain camera."""
    camera = rs.Camera([[100, 0, 0], [0, 100, 0], [0, 0, 1]], (32, 32))
    tag = rs.vision.Tag("tag36h11", 0, size=0.16)  # its left edge is at column 100 (x - 0.08) / 1
    image = rs.vision.render_targets(camera, {tag: rs.Pose.at(0.233, 0.18, 1.0)})
    row = image[16].astype(float)  # within the black border, from paper to ink
    share = (row - 30) / (225 - 30)
    np.testing.assert_allclose(share[14:17], [1, 0.8, 0], rtol=0, atol=1 / 16 + 1 / 255)


def test_marks_behind_the_camera_are_not_rendered():
    tag = rs.vision.Tag("tag36h11", 0, size=0.1)
    assert (rs.vision.render_targets(CAMERA, {tag: rs.Pose.at(0, 0, -0.3)}) == 128).all()


def test_the_plates_of_a_tag_cover_its_black_cells():
    tag = rs.vision.Tag("tag25h9", 11, size=0.1)
    paper, *plates = tag.shapes
    assert all(plate.vertices[:, 2].max() <= paper.vertices[:, 2].min() + 1e-12 for plate in plates)
    n = len(tag.cells)
    middles = (np.arange(n) + 0.5 - n / 2) * tag.pitch
    x, y = np.meshgrid(middles, middles)
    covered = np.zeros((n, n), dtype=bool)
    for plate in plates:
        low, high = plate.vertices[:, :2].min(axis=0), plate.vertices[:, :2].max(axis=0)
        covered |= (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
    np.testing.assert_array_equal(covered, tag.cells)
    thing = rs.Object("plate", tag.shapes, marks=tag.marks)
    np.testing.assert_array_equal(thing.marks, tag.marks)


@pytest.mark.parametrize(
    "image, reason",
    [
        (None, "image: expected an array"),
        ([[0, 1]], "image: expected an array"),
        (np.zeros((0, 0), np.uint8), r"image: expected shape \(h, w\) of 16 pixels or more"),
        (np.zeros((2, 500), np.uint8), "image: expected shape"),
        (np.zeros(400, np.uint8), "image: expected shape"),
        (np.zeros((50, 50, 3), np.uint8), "has colours; make it grey"),
        (np.zeros((50, 50)), "image: expected grey values of uint8, 0 to 255, got float64"),
        (np.zeros((50, 50), np.uint16), "image: expected grey values of uint8"),
        (np.zeros((50, 50), bool), "image: expected grey values of uint8"),
    ],
)
def test_a_wrong_image_is_refused(image, reason):
    with pytest.raises(rs.errors.InputError, match=reason):
        rs.vision.TagDetector([rs.vision.Tag("tag36h11", 0, size=0.1)])(image)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shape", [(16, 16), (16, 300), (240, 320)])
def test_noise_and_odd_strides_are_no_tags(seed, shape):
    noise = np.random.default_rng(seed).integers(0, 256, (shape[0], 2 * shape[1]), dtype=np.uint8)
    tags = [rs.vision.Tag(family, 3, size=0.1) for family in ("tag36h11", "DICT_6X6_250")]
    assert dict(rs.vision.TagDetector([*tags, BOARD])(noise[::-1, ::2])) == {}
