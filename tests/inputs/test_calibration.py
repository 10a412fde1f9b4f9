"""Impossible calibrations are refused by a message of one line, before anything is estimated."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

BOARD = [[x / 10, y / 10, 0] for y in range(3) for x in range(4)]
LENS_KEYS, JOINTS = ("center", "distortion"), ("upper_arm", "forearm", "wrist_1", "wrist_2")
LENS = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], (640, 480))


@pytest.fixture(scope="module")
def bench():
    return rs.load_scenario(rs.examples.path("calibration_bench"))


@pytest.fixture(scope="module")
def q(bench):
    return rs.calibration.sample_viewpoints(
        bench, 6, rs.starts.LookAt("board", distance=(0.4, 0.6)), seed=1
    )


@pytest.fixture(scope="module")
def views(bench, q):
    return rs.calibration.simulate_views(bench, q)


def gaps(pixels, *places):
    """Pixels with NaN at some places."""
    changed = np.array(pixels)
    for place in places:
        changed[place] = np.nan
    return changed


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda v: {"scene": 3}, "scene: expected a Scene, got 3"),
        (lambda v: {"camera": "eye"}, "no camera 'eye' in the scene; cameras: camera"),
        (lambda v: {"target": "bord"}, "no object 'bord' in the scene; did you mean 'board'?"),
        (lambda v: {"q": v.q[:2], "pixels": v.pixels[:2]}, "views: expected 3 or more, got 2"),
        (lambda v: {"q": v.q[:3]}, "expected a row for each view, (V, nq) and (V, N, 2), got"),
        (lambda v: {"q": v.q[:, :5]}, "q: expected shape (..., 6), got (6, 5)"),
        (lambda v: {"pixels": v.pixels[:, :9]}, "pixels: expected shape (..., 35, 2), got"),
        (lambda v: {"pixels": v.pixels[0]}, "expected a row for each view"),
        (lambda v: {"pixels": np.inf * v.pixels}, "pixels: inf at index (0, 0, 0)"),
        (
            lambda v: {"pixels": gaps(v.pixels, (4, slice(3, None)))},
            "pixels: 3 marks seen in view 4; a view needs 4 or more: leave it out",
        ),
        (
            lambda v: {"pixels": gaps(v.pixels, (2, 7, 1))},
            "pixels: mark 7 of view 2 has one coordinate only; both coordinates of a",
        ),
        (
            lambda v: {"scene": on_the_hand(v.scene)},
            "camera 'camera' is on ur5e.flange, and target 'board' on ur5e.flange: no joint moves",
        ),
    ],
)
def test_views_are_refused(views, change, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        replace(views, **change(views))


def on_the_hand(scene):
    return scene.replacing(replace(scene.object("board"), on="ur5e.flange"))


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda v: rs.calibrate(3), "views"),
        (lambda v: rs.calibrate(v, "focal"), "also: expected a list of names, got 'focal'"),
        (
            lambda v: rs.calibrate(v, ["focus"]),
            "also: no 'focus'; did you mean 'focal'? names: focal, center, distortion, scale",
        ),
        (lambda v: rs.calibrate(v, start="tsai"), "start: no method 'tsai'; did you mean 'tsai_le"),
        (lambda v: rs.calibrate(v, noise=0), "noise must be a positive number, got 0"),
        (
            lambda v: rs.calibrate(v, ["shoulder"]),
            "views: they do not determine target.x, shoulder separately; turn the arm about",
        ),
        (
            lambda v: rs.calibrate(alike(v)),
            "views: the arm hardly rotates between views; the mount needs rotations about two",
        ),
        (lambda v: rs.calibrate(about_one_axis(v)), "views: the arm rotates about one axis only"),
        (
            lambda v: rs.calibrate(without_lens(v), ["distortion"]),
            "also: distortion: the camera has no coefficients; give the camera initial values",
        ),
        (
            lambda v: rs.calibrate(seeing(v, [0, 6, 28, 34]), ["focal", *LENS_KEYS, *JOINTS]),
            "views: 24 pixel coordinates do not determine 24 parameters: take more views",
        ),
        (
            lambda v: rs.calibrate(seeing(v, [0, 1, 2, 3])),
            "marks seen in view 0: marks: a pose needs three marks that are not on one line",
        ),
        (
            lambda v: rs.calibrate(replace(v, pixels=0 * v.pixels)),
            "pixels: view 0 shows no pose of the target",
        ),
    ],
)
def test_it_is_not_calibrated(views, make, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        make(views)


def alike(views):
    return replace(views, q=np.tile(views.q[0], (6, 1)), pixels=np.tile(views.pixels[0], (6, 1, 1)))


def about_one_axis(views):
    """The wrist alone turns, as far as the board is seen, by exact pixels."""
    q = np.tile(views.q[0], (4, 1))
    q[:, 5] += [0, 0.1, 0.2, -0.1]
    return rs.calibration.CalibrationViews(views.scene, q, views.scene.view(q).pixels)


def without_lens(views):
    bare = replace(views.lens, distortion=())
    return replace(views, scene=views.scene.replacing(replace(views.eye, camera=bare)))


def seeing(views, marks):
    """Three views of some marks."""
    others = np.delete(np.arange(35), marks)
    return rs.calibration.CalibrationViews(
        views.scene, views.q[:3], gaps(views.pixels[:3], np.s_[:, others])
    )


@pytest.mark.full
@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda b, q: rs.calibration.simulate_views(b.scene, q), "experiment"),
        (
            lambda b, q: rs.calibration.simulate_views(b, q[0]),
            "q: expected a row for each view, (V, 6), got (6,)",
        ),
        (lambda b, q: rs.calibration.simulate_views(b, q + 9.0), "q"),
        (
            lambda b, q: rs.calibration.simulate_views(b, q, camera="eye"),
            "no camera 'eye' in the scene",
        ),
        (
            lambda b, q: rs.calibration.simulate_views(b, q, seed=-1),
            "seed must be a whole number from 0 on",
        ),
        (
            lambda b, q: rs.calibration.simulate_views(b.at("sensing.outliers", 0.1), q),
            "sensing.outliers: views have noise and quantisation only",
        ),
        (lambda b, q: rs.calibration.simulate_views(b, 0 * q), "pixels: 0 marks seen in view 0"),
        (
            lambda b, q: rs.calibration.sample_viewpoints(b, 0, None),
            "count must be a whole number from 1 on",
        ),
        (
            lambda b, q: rs.calibration.sample_viewpoints(b, 6, q),
            "start: expected a sampler of configurations such as rs.starts.LookAt(",
        ),
        (
            lambda b, q: rs.calibration.sample_viewpoints(
                b, 2, rs.starts.LookAt("board", distance=(0.01, 0.02))
            ),
            "viewpoints: none of 2 samples sees the whole target: of 200 samples, ",
        ),
    ],
)
def test_it_is_not_observed(bench, q, make, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        make(bench, q)


def test_the_arguments_of_a_calibration_are_checked(bench, q):
    known = rs.calibration.simulate_views(bench.at("belief", None), q)
    found = rs.calibrate(known)
    for make, reason in [
        (lambda: found.holds(3), "truth"),
        (lambda: found.holds(bench.scene, "lens"), "part: no 'lens'; parts: mount, target"),
        (lambda: found.holds(bench.scene, level=1), "level: expected a number above 0 and below 1"),
        (lambda: found.next_poses(q[0], 1), "candidates: expected (n, 6), got (6,)"),
        (lambda: found.next_poses(q, 0), "count must be a whole number from 1 on"),
        (lambda: found.next_poses(q, 7), "candidates: 6 of 6 see the whole target within the lim"),
        (lambda: found.next_poses(q + 9.0, 1), "candidates: 0 of 6 see the whole target"),
        (lambda: found.cost(bench.scene), "experiment"),
        (lambda: found.cost(bench, 0), "runs must be a whole number from 1 on"),
        (
            lambda: found.cost(bench.at("cameras.camera.distortion", [0, 0, 0, 0, 0])),
            "camera 'camera': its lens has 5 coefficients, and 4 were calibrated",
        ),
        (
            lambda: found.cost(rs.load_scenario(rs.examples.path("eye_in_hand"))),
            "camera 'camera': its lens has 0 coefficients, and 4 were calibrated",
        ),
    ]:
        with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
            make()


@pytest.mark.parametrize(
    ("A", "B", "method", "reason"),
    [
        (np.eye(4), np.eye(4), "park_martin", "expected as many poses of the robot as of the"),
        (np.tile(np.eye(4), (2, 1, 1)), np.tile(np.eye(4), (2, 1, 1)), "daniilidis", "3 views or"),
        (np.tile(np.eye(4), (3, 1, 1)), np.tile(np.eye(4), (4, 1, 1)), "daniilidis", "got (3, 4,"),
        (
            np.tile(np.eye(4), (3, 1, 1)),
            np.tile(np.eye(4), (3, 1, 1)),
            "tsai_lenz",
            "hardly rotates",
        ),
        (3, np.eye(4), "tsai_lenz", "pose: expected"),
        (np.eye(4), np.eye(4), "horaud", "no method 'horaud'; methods: tsai_lenz, park_martin"),
    ],
)
def test_poses_are_refused(A, B, method, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        rs.calibration.solve_hand_eye(A, B, method)


def seen_from(*rpy):
    """The pixels of the board from half a metre, tilted."""
    return np.array(
        [LENS.project(BOARD, rs.Pose.at(0.15, 0.1, -0.8) @ rs.Pose.at(rpy=each)) for each in rpy]
    )


TILTED = seen_from((0, 0, 0), (0.1, 0, 0), (0, 0.1, 0.2))


@pytest.mark.parametrize(
    ("target", "pixels", "more", "reason"),
    [
        ("board", TILTED, {}, "target (marks in metres): expected numbers of shape"),
        (BOARD[0], TILTED, {}, "target (marks in metres): expected shape (..., N, 3)"),
        (BOARD, TILTED[:2], {}, "pixels: expected 3 views or more, (V, N, 2), got 2"),
        (BOARD, TILTED[0], {}, "pixels: expected 3 views or more, (V, N, 2), got 1"),
        (BOARD, TILTED[:, :5], {}, "pixels: expected shape (..., 12, 2), got (3, 5, 2)"),
        (BOARD, gaps(TILTED, np.s_[1, 3:]), {}, "pixels: 3 marks seen in view 1; a view needs 4"),
        (BOARD, TILTED, {"coefficients": 3}, "coefficients: expected 0, 4, 5 or 8, got 3"),
        (BOARD, TILTED, {"guess": 800}, "guess: expected a Camera, got 800"),
        (BOARD, TILTED, {"size": (640, 0)}, "size must be a whole number from 1 to 1000000"),
        (
            np.array(BOARD) + [[0, 0, 0.01 * (i % 3)] for i in range(12)],
            TILTED,
            {},
            "target: its marks are not in a plane: give a first estimate, guess=",
        ),
        (
            BOARD,
            seen_from((0, 0, 0), (0, 0, 0.3), (0.01, 0, -0.5)),
            {},
            "views: the planes of all 3 are parallel within 5 degrees, so the "
            "focal length is undetermined: tilt the target by 20 degrees or more",
        ),
        (BOARD, gaps(TILTED, np.s_[2, 4:]), {}, "pixels: the marks of view 2 are on a line"),
    ],
)
def test_a_lens_is_not_calibrated(target, pixels, more, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        rs.calibration.calibrate_lens(target, pixels, **{"size": (640, 480), **more})


def test_a_lens_without_opencv_is_reported(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(rs.errors.InputError, match=r"a lens calibration needs OpenCV: pip"):
        rs.calibration.calibrate_lens(
            BOARD, seen_from((0, 0, 0), (0.4, 0, 0), (0, 0.4, 0.2)), (640, 480)
        )


def test_numbers_that_are_given_are_as_many_as_the_draws():
    one = rs.load_scenario(rs.examples.path("visp_tutorial"))
    for sampler in (
        rs.samplers.TabulatedValues([1.0, 2.0]),
        rs.samplers.Product(rs.samplers.TabulatedValues([1.0, 2.0])),
    ):
        with pytest.raises(
            rs.errors.InputError, match=r"runs: 3, but task\.gain has values for 2 draws"
        ):
            rs.study(one, 3, vary={"task.gain": sampler})
    with pytest.raises(
        rs.errors.InputError, match="TabulatedValues: expected one row of numbers for each draw"
    ):
        rs.samplers.TabulatedValues(1.0)
