"""Calibrations in YAML, and files that OpenCV reads and writes."""

import json
import re
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

import robsim as rs

ORACLES = Path(__file__).parents[1] / "oracles"
CASES = json.loads((ORACLES / "calibrations_opencv.json").read_text(encoding="utf-8"))["cases"]
LENS = (-0.28, 0.07, 1.2e-3, -8e-4, 1 / 3, 0.02, -0.015, 1e-7)
K = [[811.5, 0, 321.1], [0, 799.1, 238.7], [0, 0, 1]]
CAMCHAIN = """
cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  distortion_model: radtan
  distortion_coeffs: [-2.7695497e-1, 6.7e-02, 1e-3, 0.00011556]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: pinhole
  intrinsics: [460.0, 459.0, 370.0, 240.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [752, 480]
  T_cn_cnm1:
  - [0.0, 1.0, 0.0, -0.11]
  - [-1.0, 0.0, 0.0, 0.02]
  - [0.0, 0.0, 1.0, 0.01]
  - [0.0, 0.0, 0.0, 1.0]
"""
ROS = """image_width: 640
image_height: 480
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [500.1, 0, 320, 0, 501, 240, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.1, 2e-2, 0.0001, -1.e-3, 0]
"""
ECHO = """header:
  stamp: {sec: 1, nanosec: 2}
  frame_id: left
height: 480
width: 640
distortion_model: plumb_bob
d: [-0.1, 0.02, 0.0001, -0.001, 0.0]
k: [500.1, 0.0, 320.0, 0.0, 501.0, 240.0, 0.0, 0.0, 1.0]
---
"""


def write_calibration(folder, text):
    path = folder / "calibration.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("case", CASES, ids=lambda case: str(len(case["distortion"])))
@pytest.mark.parametrize("version", ["%YAML:1.0", "%YAML 1.2"])
def test_a_file_of_opencv_gives_its_camera(case, version, tmp_path):
    text = re.sub(r"^%YAML[^\n]*", version, case["yaml"])
    camera = rs.Camera.from_file(write_calibration(tmp_path, text))
    assert camera.K.tolist() == case["K"] and camera.size == tuple(case["size"])
    assert list(camera.distortion) == case["distortion"][:8]


@pytest.mark.parametrize("ending", ["yaml", "yml", "xml"])
@pytest.mark.parametrize("count", [0, 4, 5, 8])
@pytest.mark.parametrize("size", [(640, 480), None])
def test_opencv_reads_our_files_to_the_last_digit(ending, count, size, tmp_path):
    camera = rs.Camera(K, size, distortion=LENS[:count])
    path = camera.to_file(tmp_path / f"camera.{ending}")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert file.getNode("camera_matrix").mat().tolist() == K
    lens = file.getNode("distortion_coefficients").mat()
    assert ([] if lens is None else lens.ravel().tolist()) == list(LENS[:count])
    assert file.getNode("image_width").real() == (640 if size else 0)
    assert rs.Camera.from_file(path) == camera


def test_our_files_have_all_fields_that_ros_requires(tmp_path):
    """As camera_calibration_parsers reads it: plain YAML, where tags do not matter."""
    path = rs.Camera(K, (640, 480), distortion=LENS).to_file(tmp_path / "camera.yaml")
    found = yaml.safe_load(path.read_text().replace("!!opencv-matrix", ""))
    assert found["image_width"] == 640 and found["camera_name"] == "camera"
    assert found["distortion_model"] == "rational_polynomial"
    shapes = {name: [t["rows"], t["cols"]] for name, t in found.items() if isinstance(t, dict)}
    assert shapes == {
        "camera_matrix": [3, 3],
        "distortion_coefficients": [1, 8],
        "rectification_matrix": [3, 3],
        "projection_matrix": [3, 4],
    }
    np.testing.assert_array_equal(np.reshape(found["projection_matrix"]["data"], (3, 4))[:, :3], K)


@pytest.mark.parametrize("text", [ROS, ECHO])
def test_a_file_and_an_echo_of_ros_give_its_camera(text, tmp_path):
    camera = rs.Camera.from_file(write_calibration(tmp_path, text))
    assert camera.K.tolist() == [[500.1, 0, 320], [0, 501, 240], [0, 0, 1]]
    assert camera.distortion == (-0.1, 0.02, 1e-4, -1e-3, 0) and camera.size == (640, 480)


def test_a_chain_of_kalibr_is_a_rig(tmp_path):
    """T_cn_cnm1 takes points of cam0 to cam1, so both cameras see a point at its true place."""
    path = write_calibration(tmp_path, CAMCHAIN)
    left, right = rs.MountedCamera.rig_from_file(path, on="arm.tool", pose=rs.Pose.at(0, 0, 0.1))
    assert (left.name, right.name, left.on, right.on) == ("cam0", "cam1", "arm.tool", "arm.tool")
    assert left.camera == rs.Camera.from_file(path, "cam0")
    assert left.camera.distortion == (-0.27695497, 0.067, 1e-3, 0.00011556)
    X_0 = np.array([0.1, 0.2, 2.0])
    X_1 = [0.2 - 0.11, -0.1 + 0.02, 2.01]
    np.testing.assert_allclose(right.pose.inv() @ (left.pose @ X_0), X_1, rtol=0, atol=1e-15)
    np.testing.assert_allclose(left.pose.position, [0, 0, 0.1])


BAD = {
    "K: [1, 2": ":2: not valid YAML: did not find expected",
    "a: 1\na: 2\n": ":2: the key 'a' occurs twice",
    "a: &b [1]\nK: *b\n": ":2: the alias *b is not allowed",
    "[" * 40: "nested more than 16 deep",
    "? [1]\n: 2\n": ":1: a key must be a text",
    "a: 1\n---\nb: 2\n": ":3: a second document; expected one",
    "- 1\n- 2\n": "expected keys such as camera_matrix, cameraMatrix or K, got [1.0, 2.0]",
    "K: !!python/object/apply:os.system ['true']\n": "K: expected a number, got ['true']",
    "camera_matrix: 5\n": "camera_matrix: expected a matrix, got 5.0",
    ROS.replace("501, ", "", 1): "3.0 rows and 3.0 columns, but 8 numbers",
    ROS.replace("plumb_bob", "equidistant"): "distortion: expected 0 or 4 numbers (k1 k2 k3 k4) of",
    ROS.replace("plumb_bob", "fov"): "distortion_model 'fov' is not supported: expected a perspec",
    ROS[:130]: "not valid YAML",
    CAMCHAIN.replace("pinhole", "omni"): "cam0: camera_model 'omni' is not supported",
    CAMCHAIN.replace("radtan", "fov"): "cam0: distortion_model 'fov' is not supported",
    CAMCHAIN.replace("  resolution: [752, 480]\n", "", 1): "cam0: resolution is missing",
    CAMCHAIN.replace("461.629, ", ""): "cam0: intrinsics: expected shape (..., 4)",
    "cam0: 3\nK: 5\n": "K: expected a matrix, got 5.0",
}


@pytest.mark.parametrize("text", BAD)
def test_a_wrong_file_is_refused_in_one_line(text, tmp_path):
    with pytest.raises(rs.errors.FileError, match=re.escape(BAD[text])) as caught:
        rs.Camera.from_file(write_calibration(tmp_path, text), "cam0")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text, reason",
    [
        (ROS, "no poses of cameras, as in Kalibr's camchain.yaml"),
        (CAMCHAIN.replace("T_cn_cnm1", "T_cn"), "cam1: T_cn_cnm1: is missing: the transform"),
        (CAMCHAIN.replace("1.0, 0.0, -0.11", "2.0, 0.0, -0.11"), "cam1: T_cn_cnm1: "),
    ],
)
def test_an_invalid_rig_is_refused(text, reason, tmp_path):
    with pytest.raises(rs.errors.FileError, match=re.escape(reason)):
        rs.MountedCamera.rig_from_file(write_calibration(tmp_path, text))


FISHEYE = rs.Camera(K, (640, 480), distortion=(-0.05, 0.02, -0.01, 1 / 3000), lens="fisheye")
RAYS = np.random.default_rng(2).uniform([-6, -6, 0.2], [6, 6, 3], (300, 3))


@pytest.mark.parametrize("skew", [0.0, 2.5])
@pytest.mark.parametrize("lens", [(0, 0, 0, 0), FISHEYE.distortion, (0.1, -0.02, 0, 0)])
def test_opencv_sees_the_same_pixels_through_a_fisheye(skew, lens):
    """OpenCV's alpha is the skew divided by fx; its inverse ends at distances of pi / 2."""
    matrix = np.array(K, dtype=float)
    zero, coefficients = np.zeros(3), np.array(lens, dtype=float)
    theirs, _ = cv2.fisheye.projectPoints(
        RAYS[:, None], zero, zero, matrix, coefficients, alpha=skew / matrix[0, 0]
    )
    skewed = matrix + np.outer([skew, 0, 0], [0, 1, 0])
    camera = rs.Camera(skewed, distortion=lens, lens="fisheye")
    pixels = camera.project(RAYS, rs.Pose.at())
    np.testing.assert_allclose(pixels, theirs[:, 0], rtol=0, atol=1e-11)
    if not skew:
        back = cv2.fisheye.undistortPoints(theirs, matrix, coefficients)[:, 0]
        distances = np.linalg.norm((pixels - matrix[:2, 2]) / matrix[[0, 1], [0, 1]], axis=1)
        within = distances < np.pi / 2
        assert within.sum() > 200
        np.testing.assert_allclose(camera.normalise(pixels)[within], back[within], rtol=1e-6)


@pytest.mark.parametrize("ending", ["yaml", "xml"])
def test_opencv_and_ros_read_our_fisheye(ending, tmp_path):
    path = FISHEYE.to_file(tmp_path / f"camera.{ending}")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    lens = file.getNode("distortion_coefficients").mat()
    assert lens.ravel().tolist() == list(FISHEYE.distortion)
    assert file.getNode("distortion_model").string() == "equidistant"
    assert file.getNode("fisheye_model").real() == 1
    assert rs.Camera.from_file(path) == FISHEYE


def test_k_and_d_of_opencv_s_fisheye_take_the_name_of_the_model(tmp_path):
    """`cv2.fisheye.calibrate` returns D as a column, and a file of K and D has no model."""
    path = tmp_path / "fisheye.yml"
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("K", np.array(K, dtype=float))
    file.write("D", np.array(FISHEYE.distortion)[:, None])
    file.release()
    assert rs.Camera.from_file(path, lens="fisheye") == FISHEYE.revised(size=None)
    assert rs.Camera.from_file(path).lens == "perspective"


def test_a_chain_of_kalibr_and_a_file_of_ros_may_have_fisheyes(tmp_path):
    chain = CAMCHAIN.replace("radtan", "equidistant")
    left, right = rs.MountedCamera.rig_from_file(write_calibration(tmp_path, chain))
    assert (left.camera.lens, right.camera.lens) == ("fisheye", "perspective")
    assert left.camera.distortion == (-0.27695497, 0.067, 1e-3, 0.00011556)
    ros = ROS.replace("plumb_bob", "equidistant").replace("cols: 5", "cols: 4")
    path = write_calibration(tmp_path, ros.replace(", -1.e-3, 0]", ", -1.e-3]"))
    camera = rs.Camera.from_file(path)
    assert camera.lens == "fisheye" and camera.distortion == (-0.1, 0.02, 1e-4, -1e-3)


def test_a_bomb_of_aliases_and_a_long_list_end_at_once(tmp_path):
    lines = [f"{b}: &{b} [*{a}, *{a}]\n" for a, b in pairwise("abcdefg")]
    bomb = "a: &a [x]\n" + "".join(lines)
    with pytest.raises(rs.errors.FileError, match="alias"):
        rs.Camera.from_file(write_calibration(tmp_path, bomb))
    with pytest.raises(rs.errors.FileError, match="no camera matrix"):
        rs.Camera.from_file(write_calibration(tmp_path, f"points: [{'1.5, ' * 50_000}]\n"))


@pytest.mark.parametrize("size", [(320, 240), (160, 120), (1280, 960)])
def test_a_resized_camera_sees_a_drawn_blob_where_opencv_puts_it(size):
    camera = rs.Camera([[500, 0, 317.3], [0, 490, 241.9], [0, 0, 1]], (640, 480))
    (u, v), point = camera.project([[0.1, -0.05, 1.0]], rs.Pose.at())[0], [[0.1, -0.05, 1.0]]
    x, y = np.meshgrid(np.arange(640), np.arange(480))
    blob = np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * 12.0**2))
    way = cv2.INTER_AREA if size[0] < 640 else cv2.INTER_LINEAR
    image = cv2.resize(blob, size, interpolation=way)
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    centre = [(x * image).sum() / image.sum(), (y * image).sum() / image.sum()]
    seen = camera.resized(*size).project(point, rs.Pose.at())[0]
    np.testing.assert_allclose(seen, centre, rtol=0, atol=1e-3)
