"""Cameras in files and messages of other programs, and of images that were scaled or cut."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs

HERE = rs.Pose.at()
POINTS = [[0.1, -0.2, 1.0], [-0.3, 0.1, 1.2], [0.02, 0.25, 0.8], [0, 0, 2]]
LENS = (-0.28, 0.07, 1.2e-3, -8e-4, -0.01, 0.02, -0.015, 0.004)
CAMERA = rs.Camera([[811.5, 0, 321.25], [0, 799.1, 238.7], [0, 0, 1]], (640, 480), distortion=LENS)
INFO = {
    "width": 640,
    "height": 480,
    "distortion_model": "rational_polynomial",
    "k": CAMERA.K.ravel(),
    "d": list(LENS),
    "p": [700.0, 0, 300, -70, 0, 700, 200, 0, 0, 0, 1, 0],
}
finite = st.floats(-1e6, 1e6, allow_nan=False)


def project(camera):
    return camera.project(POINTS, HERE)


@pytest.mark.parametrize("size", [(320, 240), (1280, 960), (853, 640), (64, 48)])
def test_a_resized_camera_sees_where_the_pixels_of_the_scaled_image_are(size):
    """The area of a pixel is scaled, not its centre: u' + 0.5 = (u + 0.5) width'/width."""
    scale = np.array(size) / CAMERA.size
    np.testing.assert_allclose(
        project(CAMERA.resized(*size)), (project(CAMERA) + 0.5) * scale - 0.5, rtol=0, atol=1e-10
    )


def test_a_camera_resized_and_back_is_the_same():
    back = CAMERA.resized(320, 240).resized(640, 480)
    np.testing.assert_allclose(back.K, CAMERA.K, rtol=1e-15)
    assert back.distortion == CAMERA.distortion and back.size == CAMERA.size


def test_stretching_is_reported():
    with pytest.raises(
        rs.errors.InputError, match="640 x 480 pixels resized to 640 x 360 changes the a"
    ):
        CAMERA.resized(640, 360)
    K = CAMERA.resized(640, 360, stretch=True).K
    np.testing.assert_allclose(K[1], [0, 0.75 * 799.1, 239.2 * 0.75 - 0.5])
    assert K[0].tolist() == CAMERA.K[0].tolist()


def test_a_cropped_camera_sees_the_same_pixels_from_another_corner():
    part = CAMERA.cropped(100, 50, 320, 240)
    np.testing.assert_allclose(project(part), project(CAMERA) - [100, 50], rtol=0, atol=1e-10)
    assert part.size == (320, 240)


@pytest.mark.parametrize("ending", ["xml", "txt"])
@settings(derandomize=True, max_examples=25, deadline=None)
@given(
    focal=st.tuples(*[st.floats(1, 1e6)] * 2),
    centre=st.tuples(finite, finite),
    count=st.sampled_from([0, 4, 8, "fisheye"]),
    lens=st.lists(finite, min_size=8, max_size=8),
)
def test_a_written_file_is_read_to_the_last_digit(
    tmp_path_factory, ending, focal, centre, count, lens
):
    (fx, fy), (cx, cy) = focal, centre
    bends = {"distortion": lens[:4], "lens": "fisheye"}
    if count != "fisheye":
        bends = {"distortion": lens[:count]}
    camera = rs.Camera([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], (640, 480), **bends)
    path = camera.to_file(tmp_path_factory.getbasetemp() / f"camera.{ending}")
    assert rs.Camera.from_file(path) == camera


def test_a_written_file_without_a_size_or_a_lens_is_read_so(tmp_path):
    camera = rs.Camera(CAMERA.K)
    assert rs.Camera.from_file(camera.to_file(tmp_path / "a.xml")) == camera


# (model, parameters, k1 k2 p1 p2 of COLMAP's definition)
COLMAP = {
    "SIMPLE_PINHOLE": ([500, 320, 240], []),
    "PINHOLE": ([500, 510, 320, 240], []),
    "SIMPLE_RADIAL": ([500, 320, 240, -0.1], [-0.1]),
    "RADIAL": ([500, 320, 240, -0.1, 0.02], [-0.1, 0.02]),
    "OPENCV": ([500, 510, 320, 240, -0.1, 0.02, 1e-3, 2e-3], [-0.1, 0.02, 1e-3, 2e-3]),
    "FULL_OPENCV": ([500, 510, 320, 240, *LENS], LENS),
    "SIMPLE_FISHEYE": ([500, 320, 240], []),
    "FISHEYE": ([500, 510, 320, 240], []),
    "SIMPLE_RADIAL_FISHEYE": ([500, 320, 240, -0.1], [-0.1]),
    "RADIAL_FISHEYE": ([500, 320, 240, -0.1, 0.02], [-0.1, 0.02]),
    "OPENCV_FISHEYE": ([500, 510, 320, 240, -0.1, 0.02, 1e-3, 2e-3], [-0.1, 0.02, 1e-3, 2e-3]),
}


def by_colmap(parameters, lens, fisheye):
    """Pixels by COLMAP's formulas (src/colmap/sensor/models.h); the image begins at (0, 0)."""
    one = len(parameters) - len(lens) == 3
    fx, fy, cx, cy = [parameters[0], *parameters[:3]] if one else parameters[:4]
    k1, k2, p1, p2, k3, k4, k5, k6 = [*lens, *[0.0] * (8 - len(lens))]
    u, v = (np.array(POINTS) / np.array(POINTS)[:, 2:])[:, :2].T
    r2 = u * u + v * v
    if fisheye:
        r = np.sqrt(r2) + 1e-300
        t = np.arctan(r) ** 2
        scale = np.arctan(r) / r * (1 + k1 * t + k2 * t**2 + p1 * t**3 + p2 * t**4)
        scale[r2 == 0] = 1
        return np.column_stack([fx * u * scale + cx, fy * v * scale + cy])
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    x = u * radial + 2 * p1 * u * v + p2 * (r2 + 2 * u * u)
    y = v * radial + 2 * p2 * u * v + p1 * (r2 + 2 * v * v)
    return np.column_stack([fx * x + cx, fy * y + cy])


@pytest.mark.parametrize("model", COLMAP)
def test_a_camera_of_colmap_sees_half_a_pixel_less(model, tmp_path):
    parameters, lens = COLMAP[model]
    path = tmp_path / "cameras.txt"
    path.write_text(f"# a comment\n\n7 {model} 640 480 {' '.join(map(str, parameters))}\n")
    camera = rs.Camera.from_file(path)
    expected = by_colmap(parameters, lens, "FISHEYE" in model)
    np.testing.assert_allclose(project(camera) + 0.5, expected, rtol=0, atol=1e-9)


def test_one_of_several_cameras_is_chosen_by_its_name(tmp_path):
    path = tmp_path / "cameras.txt"
    path.write_text("1 PINHOLE 640 480 500 500 320 240\n2 PINHOLE 800 600 600 600 400 300\n")
    assert rs.Camera.from_file(path, "2").size == (800, 600)
    with pytest.raises(rs.errors.FileError, match="2 cameras, 1, 2: choose one by name="):
        rs.Camera.from_file(path)
    with pytest.raises(rs.errors.FileError, match="no camera '3'; "):
        rs.Camera.from_file(path, "3")


def test_two_cameras_of_a_stereo_pair_share_the_size(tmp_path):
    def matrix(name, rows, *values):
        data = " ".join(map(str, values))
        cols = len(values) // rows
        return (
            f'<{name} type_id="opencv-matrix"><rows>{rows}</rows><cols>{cols}</cols>'
            f"<dt>d</dt><data>{data}</data></{name}>"
        )

    path = tmp_path / "pair.xml"
    left, right = (500, 0, 320, 0, 500, 240, 0, 0, 1), (600, 0, 310, 0, 600, 230, 0, 0, 1)
    parts = [matrix("M1", 3, *left), matrix("D1", 1, 0.1, 0, 0, 0), matrix("M2", 3, *right)]
    size = "<image_width>640</image_width><image_height>480</image_height>"
    path.write_text(f"<opencv_storage>{size}{''.join(parts)}</opencv_storage>")
    pair = [rs.Camera.from_file(path, name) for name in ("1", "2")]
    assert [camera.K[0, 0] for camera in pair] == [500, 600]
    assert [camera.size for camera in pair] == [(640, 480)] * 2
    assert [camera.distortion for camera in pair] == [(0.1, 0, 0, 0), ()]


@pytest.mark.parametrize("as_message", [False, True])
@pytest.mark.parametrize("capital", [False, True])
def test_a_message_of_ros_1_or_2_gives_its_camera(as_message, capital):
    info = {k.upper() if capital and len(k) == 1 else k: v for k, v in INFO.items()}
    assert rs.Camera.from_ros(SimpleNamespace(**info) if as_message else info) == CAMERA


def test_a_rectified_camera_agrees_with_p_without_a_lens():
    camera = rs.Camera.from_ros(INFO, rectified=True)
    assert camera == rs.Camera([[700, 0, 300], [0, 700, 200], [0, 0, 1]], (640, 480))


def test_a_region_of_interest_and_bins_agree_with_the_image_that_comes():
    roi = {"x_offset": 100, "y_offset": 50, "width": 321, "height": 240}
    camera = rs.Camera.from_ros({**INFO, "roi": roi, "binning_x": 2, "binning_y": 3})
    assert camera.size == (160, 80)
    wanted = (project(CAMERA) - [100, 50] + 0.5) / [2, 3] - 0.5  # a bin's middle, from its pixels'
    np.testing.assert_allclose(project(camera), wanted, rtol=0, atol=1e-10)


@pytest.mark.parametrize("model", ["equidistant", "fisheye", "kannala_brandt", "KANNALA_BRANDT4"])
def test_a_message_of_a_fisheye_gives_its_camera(model):
    info = {**INFO, "distortion_model": model, "d": LENS[:4]}
    camera = rs.Camera.from_ros(info)
    assert camera == rs.Camera(CAMERA.K, CAMERA.size, distortion=LENS[:4], lens="fisheye")
    rectified = rs.Camera.from_ros(info, rectified=True)
    assert rectified.lens == "perspective" and rectified.distortion == ()
