"""The errors of poses, points and planes that are estimated from unusable input."""

import numpy as np
import pytest

import robsim as rs

CAMERA = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
SQUARE = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
PIXELS = CAMERA.project(SQUARE, rs.Pose.at(0, 0, -1))
LINE = np.arange(4)[:, None] * [0.1, -0.2, 0.3] + 1.0
TWO = SQUARE[[0, 1, 0, 1]]
RIG = rs.Pose.at(0.1, 0, 0)


@pytest.mark.parametrize(
    ("marks", "pixels", "camera", "noise", "message"),
    [
        (LINE, PIXELS, CAMERA, None, "marks: a pose needs three marks that are not on one line"),
        (TWO, PIXELS, CAMERA, None, "or coincide"),
        (0 * SQUARE, PIXELS, CAMERA, None, "or coincide"),
        (SQUARE[:2], PIXELS[:2], CAMERA, None, r"three marks or more, got shape \(2, 3\)"),
        (SQUARE[None], PIXELS, CAMERA, None, r"expected \(N, 3\) .* got shape \(1, 4, 3\)"),
        (SQUARE[:, :2], PIXELS, CAMERA, None, r"marks: expected shape \(..., N, 3\), got \(4, 2\)"),
        (SQUARE + np.inf, PIXELS, CAMERA, None, "every number must be finite"),
        ("square", PIXELS, CAMERA, None, "marks: expected numbers"),
        (SQUARE, PIXELS[:3], CAMERA, None, r"pixels: expected shape \(..., 4, 2\), got \(3, 2\)"),
        (SQUARE, PIXELS + np.inf, CAMERA, None, "pixels: inf at index"),
        (SQUARE, [["a", "b"]] * 4, CAMERA, None, "pixels: expected numbers"),
        (SQUARE, PIXELS, CAMERA.K, None, "pixels: expected the Camera of the image, got array"),
        (SQUARE, PIXELS, None, None, "expected the Camera of the image, got None"),
        (SQUARE, PIXELS, CAMERA, 0, "noise must be a positive number, got 0"),
        (SQUARE, PIXELS, CAMERA, [1.0, 2.0], "noise must be a positive number"),
        (SQUARE, PIXELS, CAMERA, 1e300, r"noise: expected pixels, at most 1e\+100, got 1e\+300"),
    ],
)
def test_a_pose_reports_the_input_that_it_needs(marks, pixels, camera, noise, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.vision.estimate_pose(marks, pixels, camera, noise=noise)


def test_no_runs_have_no_poses():
    assert rs.vision.estimate_pose(SQUARE, np.zeros((0, 4, 2)), CAMERA).T_c_o.shape == (0, 4, 4)
    assert rs.vision.estimate_homography(np.zeros((0, 4, 2)), np.zeros((0, 4, 2))).shape == (
        0,
        3,
        3,
    )
    found = rs.vision.triangulate(np.zeros((0, 4, 2)), np.zeros((0, 4, 2)), CAMERA, CAMERA, RIG)
    assert found.points.shape == (0, 4, 3) and found.covariance.shape == (0, 4, 3, 3)
    assert rs.vision.decompose_homography(np.zeros((0, 3, 3))).rotations.shape == (0, 4, 3, 3)


def test_an_estimate_is_a_value_with_a_readable_text():
    found = rs.vision.estimate_pose(SQUARE, PIXELS, CAMERA)
    assert found == rs.vision.estimate_pose(SQUARE, PIXELS, CAMERA)
    assert repr(found).startswith("<PoseEstimate position [0.0, 0.0, 1.0] rms ")
    assert (
        repr(rs.vision.estimate_pose(SQUARE, PIXELS[None], CAMERA)) == "<PoseEstimate batch (1,)>"
    )
    with pytest.raises(ValueError, match="read-only"):
        found.T_c_o[0, 0] = 2.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"left": "left"}, "pixels_left: expected the Camera of the image, got 'left'"),
        ({"right": None}, "pixels_right: expected the Camera"),
        ({"pixels_right": PIXELS[:3]}, "the same points in both images, got 4 and 3 points"),
        ({"pixels_left": PIXELS[:, :1]}, r"pixels_left: expected shape \(..., N, 2\)"),
        ({"T_left_right": rs.Pose.at(0, 0, 0, rpy=(0, 1, 0))}, "cameras have the same position"),
        ({"T_left_right": np.eye(3)}, r"T_left_right: pose: expected shape \(..., 4, 4\)"),
        ({"noise": -1}, "noise must be a positive number, got -1"),
        ({"noise": 1e300}, r"noise: expected pixels, at most 1e\+100, got 1e\+300"),
        ({"pixels_left": np.zeros((2, 4, 2)), "pixels_right": np.zeros((3, 4, 2))}, "unequal"),
        ({"T_left_right": rs.Pose(np.stack([RIG.matrix] * 2)), "pixels_left": [PIXELS] * 3}, "une"),
    ],
)
def test_two_images_report_the_input_that_they_need(change, message):
    given = {"pixels_left": PIXELS, "pixels_right": PIXELS, "left": CAMERA, "right": CAMERA}
    with pytest.raises(rs.errors.InputError, match=message):
        rs.vision.triangulate(**({"T_left_right": RIG} | given | change))


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        (PIXELS[:3], PIXELS[:3], "takes four points or more, the same in both images; got 3 and 3"),
        (PIXELS, PIXELS[:3], "got 4 and 3"),
        (SQUARE, PIXELS, r"points_a: expected shape \(..., N, 2\)"),
        (PIXELS, None, "points_b: expected numbers"),
        (np.zeros((2, 4, 2)), np.zeros((3, 4, 2)), "unequal shapes"),
    ],
)
def test_a_homography_reports_the_input_that_it_needs(a, b, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.vision.estimate_homography(a, b)


@pytest.mark.parametrize(
    ("H", "message"),
    [
        (np.eye(4), r"H: expected shape \(..., 3, 3\), got \(4, 4\)"),
        (-np.eye(3), "positive determinant"),
        (np.zeros((3, 3)), "positive determinant"),
        ("H", "H: expected numbers"),
    ],
)
def test_motions_report_the_input_that_they_need(H, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.vision.decompose_homography(H)


def test_a_homography_that_is_not_known_has_no_motions():
    found = rs.vision.decompose_homography([np.full((3, 3), np.nan), np.eye(3)])
    assert np.isnan(found.rotations[0]).all() and not found.in_front[0].any()
    assert found.in_front[1].tolist() == [True, False, False, False]


@pytest.mark.parametrize("size", [1e-49, 1e-9, 1e9, 1e150, 1e300])
def test_numbers_without_sense_are_no_errors_of_ours(size):
    """Whatever the size of the input: an answer, or none, or an InputError."""
    assert rs.vision.estimate_pose(size * SQUARE / 0.1, PIXELS, CAMERA).rms.shape == ()
    assert rs.vision.estimate_pose(SQUARE, size * PIXELS, CAMERA).rms.shape == ()
    assert rs.vision.estimate_homography(PIXELS, size * PIXELS).shape == (3, 3)
    assert rs.vision.decompose_homography(size * np.eye(3)).in_front[0]
    for shift in ((size, 0, 0), (0, 0, size), (size, size, size)):
        found = rs.vision.triangulate(PIXELS, size * PIXELS, CAMERA, CAMERA, rs.Pose.at(*shift))
        assert found.points.shape == (4, 3)


def test_points_on_the_line_between_the_cameras_are_not_known():
    rig = rs.Pose.at(0, 0, 0.1)
    found = rs.vision.triangulate(
        [[320, 240], [360, 240]], [[320, 240], [365, 240]], CAMERA, CAMERA, rig
    )
    assert np.isnan(found.points[0]).all() and np.isnan(found.covariance[0]).all()
    np.testing.assert_allclose(found.points[1], [0.045, 0, 0.9], rtol=1e-12)
