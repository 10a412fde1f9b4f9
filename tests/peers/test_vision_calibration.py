"""Lenses that OpenCV finds, and from images to a mount."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

import robsim as rs

BOARD = rs.vision.Board("DICT_4X4_50", columns=8, rows=6, square=0.03, tag=0.022)


@pytest.fixture(scope="module")
def bench():
    return rs.load_scenario(rs.examples.path("calibration_bench"))


@pytest.fixture(scope="module")
def views(bench):
    look = rs.starts.LookAt("board", distance=(0.3, 0.8), cone=0.8, aside=0.1)
    return rs.calibration.simulate_views(
        bench.at("belief", None), rs.calibration.sample_viewpoints(bench, 15, look, seed=3)
    )


@pytest.mark.parametrize("coefficients", [4, 5])
def test_a_lens_is_found_to_its_deviations(bench, views, coefficients):
    found = rs.calibration.calibrate_lens(
        BOARD, views.pixels, (1280, 960), coefficients=coefficients
    )
    true = bench.scene.camera().camera
    K = [*true.K[[0, 1, 0, 1], [0, 1, 2, 2]], *true.distortion, 0.0][: 4 + coefficients]
    own = found.camera
    values = [*own.K[[0, 1, 0, 1], [0, 1, 2, 2]], *own.distortion]
    off = np.subtract(values, K) / list(found.deviations.values())
    assert (np.abs(off) < 4).all() and list(found.deviations)[-1] == ("p2", "k3")[coefficients - 4]
    residuals = rs.vision.estimate_pose(BOARD.marks, views.pixels, own).rms
    np.testing.assert_allclose(found.errors, residuals * np.sqrt(2), rtol=1e-3)
    assert abs(found.rms - np.sqrt(np.square(found.errors).mean())) < 1e-6
    np.testing.assert_allclose(
        rs.vision.estimate_pose(BOARD.marks, views.pixels, own).T_c_o[:, :3, 3],
        found.poses.position,
        atol=2e-4,
    )


def test_a_lens_is_found_of_marks_that_are_partly_seen(views):
    pixels = np.array(views.pixels)
    pixels[::2, :12] = np.nan
    part = rs.calibration.calibrate_lens(BOARD, pixels, (1280, 960), coefficients=4)
    K = rs.calibration.calibrate_lens(BOARD, views.pixels, (1280, 960), coefficients=4).camera.K
    assert np.abs(part.camera.K - K).max() < 5 * max(part.deviations[n] for n in ("fx", "cx", "cy"))


def test_a_tag_determines_a_lens_too():
    """By four exact corners in each of eight views."""
    tag, lens = rs.vision.Tag("tag36h11", 7, size=0.2), [[800, 0, 330], [0, 810, 230], [0, 0, 1]]
    turns = np.random.default_rng(5).uniform(-0.6, 0.6, (8, 3))
    poses = rs.Pose.at(0, 0, np.linspace(0.4, 0.8, 8), rotvec=turns)
    pixels = rs.Camera(lens).project(tag.marks, poses.inv())
    found = rs.calibration.calibrate_lens(tag, pixels, (640, 480), coefficients=0)
    np.testing.assert_allclose(found.camera.K, lens, atol=0.01)


def test_marks_in_space_take_a_guess():
    """Exact pixels of a cube, from a guess that is 10 percent off."""
    marks = np.array([[x, y, z] for x in (0, 1) for y in (0, 1, 2) for z in (0, 1)]) / 10
    camera = rs.Camera([[800, 0, 330], [0, 810, 230], [0, 0, 1]], (640, 480))
    turns = np.random.default_rng(2).uniform(-0.5, 0.5, (6, 3))
    poses = rs.Pose.at(0, 0, [0.7, 0.8, 0.9, 1.0, 0.6, 0.8], rotvec=turns)
    pixels = camera.project(marks, poses.inv())
    guess = rs.Camera([[720, 0, 320], [0, 720, 240], [0, 0, 1]], (640, 480))
    found = rs.calibration.calibrate_lens(marks, pixels, (640, 480), coefficients=0, guess=guess)
    np.testing.assert_allclose(found.camera.K, camera.K, atol=0.01)
    np.testing.assert_allclose(found.poses.matrix, poses.matrix, atol=1e-4)


def test_boards_that_are_drawn_and_found_calibrate_the_hand(bench, views):
    """From images to the mount: rendered, detected, calibrated."""
    detector, scene = rs.vision.TagDetector([BOARD]), bench.scene
    lens, q = scene.camera().camera, views.q[:5]
    T_c_o = [rs.Pose(scene.pose("camera", each).matrix).inv() for each in q]
    board = rs.Pose(scene.pose("board").matrix)
    images = [rs.vision.render_targets(lens, {BOARD: T @ board}) for T in T_c_o]
    pixels = np.stack([detector(image).pixels([BOARD]) for image in images])
    known = views.scene.replacing(bench.task.belief.camera())
    sharp = rs.calibration.CalibrationViews(known, q, pixels)
    found = rs.calibrate(sharp, ["focal", "center"])
    assert found.sigma < 0.1
    errors = found.errors(scene)
    assert np.linalg.norm(errors[:3]) < 1e-3 and np.linalg.norm(errors[3:6]) < np.radians(0.1)


ORACLE = Path(__file__).parents[1] / "oracles" / "calibration_views_opencv.json"
LENS = rs.Camera([[1105.0, 0, 646], [0, 1102, 471], [0, 0, 1]], (1280, 960))
FINE = 4  # pixels of a drawing along a pixel of an image


def draw_tag_by_opencv(T_c_o, side):
    """An image (960, 1280) of tag 7 with this side of its border, in metres, at T_c_o."""
    cells = cv2.aruco.generateImageMarker(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), 7, 80
    )
    picture = np.pad(cells, 20, constant_values=255)
    scale = side / 80  # of the plane of the tag, x to the right and y downwards
    plane = np.array([[scale, 0, -59.5 * scale], [0, scale, -59.5 * scale], [0, 0, 1]])
    fine = np.array([[FINE, 0, (FINE - 1) / 2], [0, FINE, (FINE - 1) / 2], [0, 0, 1]])
    H = fine @ LENS.K @ T_c_o[:3, [0, 1, 3]] @ plane
    size = (FINE * 1280, FINE * 960)
    drawn = cv2.warpPerspective(picture, H, size, flags=cv2.INTER_LINEAR, borderValue=200)
    return cv2.resize(drawn, (1280, 960), interpolation=cv2.INTER_AREA)


def test_a_small_tag_in_images_by_opencv_is_named():
    """Images of a tag of 76 mm that the user believes to be 80 mm wide, from detection to mount."""
    case = json.loads(ORACLE.read_text(encoding="utf-8"))["cases"][0]
    arm, tag = rs.robots.ur5e(), rs.vision.Tag("tag36h11", 7, size=0.08)
    eye = rs.MountedCamera("eye", LENS, on=f"{arm.name}.flange")
    scene = rs.Scene([arm], [rs.Object("tag", marks=tag.marks)], [eye])
    mount, place = rs.Pose(case["mount"]), rs.Pose(case["place"])
    q = np.array(case["q"])
    T_c_o = ((scene.pose(eye.on, q) @ mount).inv() @ place).matrix
    detector = rs.vision.TagDetector([tag])
    images = [draw_tag_by_opencv(T, 0.076) for T in T_c_o]
    pixels = np.stack([detector(image).pixels([tag]) for image in images])
    assert np.isfinite(pixels).all()
    views = rs.calibration.CalibrationViews(scene, q, pixels)
    with pytest.warns(rs.errors.FitWarning, match=r"marks 0\.9[45]\d? times as large give 0\.0\d"):
        found = rs.calibrate(views, noise=0.15)
    off = (found.mount.inv() @ mount).position
    best = (found.trials[0].mount.inv() @ mount).position
    assert np.linalg.norm(off) > 5e-3 and np.linalg.norm(best) < 5e-4
    assert np.linalg.norm([found.deviations[f"mount.{axis}"] for axis in "xyz"]) > 5e-3
    assert rs.calibrate(views, ["scale"], noise=0.15).misfit == ""


FISHEYE = rs.Camera(
    [[285.7, 0, 424.5], [0, 286.1, 399.5], [0, 0, 1]],
    (848, 800),
    distortion=(-0.008, 0.045, -0.043, 0.008),
    lens="fisheye",
)


def fisheye_views(noise, n=14):
    """The pixels of the board in views up to 70 degrees off the axis of a fisheye."""
    rng = np.random.default_rng(4)
    corner = rs.Pose.at(*-BOARD.marks.mean(axis=0))
    away, around = rng.uniform(0, 0.9, n), rng.uniform(-np.pi, np.pi, n)
    axis = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    tilt = rs.Pose.at(0, 0, rng.uniform(0.12, 0.25, n), rotvec=rng.uniform(-0.5, 0.5, (n, 3)))
    poses = rs.Pose.at(rotvec=away[:, None] * axis) @ tilt @ corner
    pixels = FISHEYE.project(BOARD.marks, poses.inv())
    assert (FISHEYE.visibility(BOARD.marks, poses.inv()) == 0).mean() > 0.9
    return pixels + noise * rng.normal(size=pixels.shape), poses


def test_a_fisheye_is_found_exactly_of_exact_pixels():
    pixels, poses = fisheye_views(0.0)
    found = rs.calibration.calibrate_lens(BOARD, pixels, FISHEYE.size, lens="fisheye")
    np.testing.assert_allclose(found.camera.K, FISHEYE.K, rtol=0, atol=1e-5)
    np.testing.assert_allclose(found.camera.distortion, FISHEYE.distortion, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.poses.position, poses.position, rtol=0, atol=1e-7)
    assert found.camera.lens == "fisheye" and found.rms < 1e-5


def test_a_fisheye_is_found_to_its_deviations():
    """Some marks hidden; errors and deviations of the size of the noise."""
    pixels, _ = fisheye_views(0.3)
    pixels[::3, :9] = np.nan
    found = rs.calibration.calibrate_lens(BOARD, pixels, FISHEYE.size, lens="fisheye")
    own = found.camera
    values = [*own.K[[0, 1, 0, 1], [0, 1, 2, 2]], *own.distortion]
    true = [*FISHEYE.K[[0, 1, 0, 1], [0, 1, 2, 2]], *FISHEYE.distortion]
    assert list(found.deviations) == ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"]
    off = np.subtract(values, true) / list(found.deviations.values())
    assert (np.abs(off) < 4).all() and np.abs(off).max() > 0.2
    assert found.rms == pytest.approx(0.3 * np.sqrt(2), rel=0.1)
    distances = np.linalg.norm(own.project(BOARD.marks, found.poses.inv()) - pixels, axis=2)
    expected = np.sqrt(np.nanmean(distances**2, axis=1))
    np.testing.assert_allclose(found.errors, expected, rtol=1e-9)
    assert found.rms == pytest.approx(np.sqrt(np.nanmean(distances**2)), rel=1e-9)
    assert "k4" in str(found)


def test_an_equidistant_fisheye_has_no_coefficients_to_find():
    pixels, _ = fisheye_views(0.0)
    bare = rs.calibration.calibrate_lens(
        BOARD, pixels, FISHEYE.size, lens="fisheye", coefficients=0, guess=FISHEYE
    )
    assert bare.camera.distortion == (0, 0, 0, 0) and bare.rms > 0.1
    assert list(bare.deviations) == ["fx", "fy", "cx", "cy"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lens": "fishey"}, "lens: no model 'fishey'; did you mean 'fisheye'?"),
        ({"lens": "fisheye", "coefficients": 5}, "coefficients: expected 0 or 4, got 5"),
        ({"coefficients": 3}, "coefficients: expected 0, 4, 5 or 8, got 3"),
        ({"guess": FISHEYE}, "guess: expected a camera with a perspective lens, got fisheye"),
    ],
)
def test_options_of_another_model_are_refused(options, words):
    with pytest.raises(rs.errors.InputError, match=re.escape(words)):
        rs.calibration.calibrate_lens(BOARD, fisheye_views(0.0)[0], FISHEYE.size, **options)


def test_opencv_finds_the_same_fisheye():
    """At the minimum of the same squares; OpenCV's skew is held at zero.

    OpenCV begins near the camera: from its own start some of its builds end in another minimum.
    """
    pixels, _ = fisheye_views(0.3)
    found = rs.calibration.calibrate_lens(BOARD, pixels, FISHEYE.size, lens="fisheye")
    objects, images = [BOARD.marks[None]] * len(pixels), [u[None] for u in pixels]
    flags = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW | cv2.CALIB_USE_INTRINSIC_GUESS
    near = FISHEYE.K * [[1.02, 0, 1.01], [0, 0.98, 0.99], [1, 1, 1]]
    rms, K_found, D, *_ = cv2.fisheye.calibrate(
        objects, images, FISHEYE.size, near, np.zeros(4), flags=flags
    )
    assert found.rms == pytest.approx(rms, rel=1e-6)
    np.testing.assert_allclose(found.camera.K, K_found, rtol=0, atol=0.01)
    np.testing.assert_allclose(found.camera.distortion, np.ravel(D), rtol=0, atol=1e-4)


def test_marks_in_space_determine_a_fisheye():
    marks = np.array([[x, y, z] for x in (0, 1) for y in (0, 1, 2) for z in (0, 1)]) / 10
    rng = np.random.default_rng(6)
    poses = rs.Pose.at(*rng.uniform(-0.2, 0.2, (2, 8)), 0.3, rotvec=rng.normal(size=(8, 3)))
    pixels = FISHEYE.project(marks, poses.inv())
    found = rs.calibration.calibrate_lens(marks, pixels, FISHEYE.size, lens="fisheye")
    np.testing.assert_allclose(found.camera.K, FISHEYE.K, rtol=0, atol=1e-5)
