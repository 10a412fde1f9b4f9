"""Faults in files and messages of cameras: one clear line each."""

import re

import pytest

import robsim as rs

K = "<data>500 0 320 0 500 240 0 0 1</data>"
MATRIX = f'<K type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>{K}</K>'
FIVE = '<D type_id="opencv-matrix"><rows>1</rows><cols>5</cols><data>0 0 0 0 0</data></D>'
K_3 = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
INFO = {"k": [500, 0, 320, 0, 500, 240, 0, 0, 1], "d": [], "width": 640, "height": 480}


def xml(inner):
    return f"<opencv_storage>{inner}</opencv_storage>"


FILES = {
    "": "empty; expected a calibration of OpenCV, ROS, Kalibr or COLMAP",
    "\n \n": "empty; expected a calibration",
    "<opencv_storage><K": ":1: not valid XML: ",
    "<calibration/>": ":1: <calibration>: expected <opencv_storage>, the root of OpenCV",
    "<!DOCTYPE a [<!ENTITY b 'c'>]><opencv_storage/>": "a DOCTYPE is not allowed",
    xml(
        "<fps>30</fps>"
    ): "no camera matrix: expected camera_matrix, cameraMatrix or K; keys: 'fps'",
    xml("<K>500</K>"): "K: expected a matrix, got 500.0",
    xml("<K>text</K>"): "K: expected a matrix, got 'text'",
    xml(MATRIX + MATRIX): "'K' occurs twice",
    xml(MATRIX + MATRIX.replace("K ", "mtx ").replace("/K", "/mtx")): "K and mtx are the same",
    xml(MATRIX.replace("<rows>3", "<rows>2")): "K: 2.0 rows and 3.0 columns, but 9 num",
    xml(MATRIX.replace("<rows>3</rows>", "")): "K: a matrix has rows, cols and data; rows is miss",
    xml(MATRIX.replace("240 0 0 1", "240")): "K: 3.0 rows and 3.0 columns, but 6 numb",
    xml(MATRIX.replace("240", ".Nan")): "K.data: nan at index (5,); every number must be finite",
    xml(MATRIX.replace("240", "wide")): "K.data: expected a number, got",
    xml(MATRIX.replace("500", "0", 1)): "K: focal lengths must be above zero",
    xml(MATRIX + "<image_width>640</image_width>"): "image_height is missing",
    xml(MATRIX + "<image_width>0</image_width><image_height>480</image_height>"): "image size must",
    xml(MATRIX + "<xi>1.2</xi>"): "xi: omnidirectional lenses are not supported: expected a persp",
    xml(MATRIX + "<distortion_model>fov</distortion_model>"): "distortion_model 'fov' is not supp",
    xml(
        MATRIX + "<distortion_model>plumb_bob</distortion_model><fisheye_model>1</fisheye_model>"
    ): "distortion_model 'plumb_bob' and fisheye_model 1.0 are different models of a lens: give",
    xml(
        MATRIX + FIVE + "<fisheye_model>1</fisheye_model>"
    ): "distortion: expected 0 or 4 numbers (k1 k2 k3 k4) of a fisheye lens, flat, in a row",
    xml(MATRIX + MATRIX.replace("K ", "D ").replace("/K", "/D")): "distortion: expected 0, 4 (k1",
    "1 PINHOLE 640 480 500 500 320\n": ":1: PINHOLE has 4 parameters, got 3",
    "1 PINHOLE 640 480 500 500 320 nan\n": ":1: 'nan' is not a finite number",
    "1 PINHOLE 640 480 500 500 320 1e999999999\n": ":1: '1e999999999' is not a finite number",
    "1 PINHOLE 640 480 500 500 320 wide\n": ":1: 'wide' is not a finite number",
    "1 PINHOLE 0 480 500 500 320 240\n": ":1: image size must be a whole number from 1 to",
    "1 FOV 640 480 500 500 320 240 0.9\n": ":1: 'FOV' is not supported; choose SIMPLE_PINHOLE, ",
    "1 OPENCV_FISHEYE 640 480 500 500 320 240 0 0\n": ":1: OPENCV_FISHEYE has 8 parameters, got 6",
    "1 PINHOLE 640 480 500 500 320 240\nand 2 more\n": ":2: ",
    "1 PINHOLE 640 480 5 5 3 2\n1 PINHOLE 640 480 5 5 3 2\n": ":2: camera '1' occurs twice",
}


@pytest.mark.parametrize("text", FILES)
def test_a_wrong_file_is_refused_in_one_line(text, tmp_path):
    path = tmp_path / "camera.xml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(rs.errors.FileError, match=re.escape(FILES[text])) as caught:
        rs.Camera.from_file(path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def test_prisms_that_are_not_zero_are_refused(tmp_path):
    data = '<D type_id="opencv-matrix"><rows>1</rows><cols>12</cols><data>{}</data></D>'
    path = tmp_path / "camera.xml"
    path.write_text(xml(MATRIX + data.format("0 " * 11 + "1e-3")))
    with pytest.raises(rs.errors.FileError, match="thin prisms and tilted sensors"):
        rs.Camera.from_file(path)


@pytest.mark.parametrize("path", [None, 3, "nowhere.yaml", "\0"])
def test_no_file_is_refused(path):
    with pytest.raises(rs.errors.FileError, match=r"no such file|cannot read"):
        rs.Camera.from_file(path)


def test_a_huge_file_and_one_that_is_no_text_are_refused(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_bytes(b" " * 1_000_001)
    with pytest.raises(rs.errors.FileError, match="larger than 1 MB"):
        rs.Camera.from_file(path)
    path.write_bytes(b"K: \xff")
    with pytest.raises(rs.errors.FileError, match="byte 3 is not UTF-8"):
        rs.Camera.from_file(path)


@pytest.mark.parametrize(
    "change, reason",
    [
        ({"k": [0] * 9}, "camera_info: k is zero: this camera is not calibrated"),
        ({"k": [1, 2]}, "camera_info: k: expected 3 x 3 numbers, got shape (2,)"),
        ({"k": "K"}, "camera_info: k: expected a number"),
        ({"k": None}, "camera_info: k is missing; keys: "),
        ({"d": [0.1, 0.2, 0.3]}, "camera_info: distortion: expected 0, 4"),
        ({"distortion_model": "fov"}, "'fov' is not supported: expected a perspective lens with k"),
        (
            {"distortion_model": "equidistant", "d": [0.1, 0, 0, 0, 0]},
            "distortion: expected 0 or 4 numbers (k1 k2 k3 k4) of a fisheye lens",
        ),
        ({"width": 0}, "camera_info: image size must be"),
        ({"roi": {"x_offset": 600, "width": 100, "height": 1}}, "exceed the image of 640 x 480"),
        ({"binning_x": -1}, "camera_info: binning must be a whole number from 1 on"),
    ],
)
def test_a_wrong_message_is_refused(change, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        rs.Camera.from_ros({**INFO, **change})


@pytest.mark.parametrize("message", [None, 3, "camera", [1, 2]])
def test_an_invalid_message_is_refused(message):
    with pytest.raises(
        rs.errors.InputError, match="expected a CameraInfo message or a dict of its fields, got"
    ):
        rs.Camera.from_ros(message)


def test_a_rectified_camera_needs_p():
    with pytest.raises(rs.errors.InputError, match="rectified: expected P of 3 x 4 numbers"):
        rs.Camera.from_ros(INFO, rectified=True)


def test_parameters_that_other_programs_would_leave_out_are_not_written(tmp_path):
    skewed = rs.Camera([[500, 2, 320], [0, 500, 240], [0, 0, 1]], (640, 480))
    with pytest.raises(rs.errors.FileError, match="2 px, which calibration files cannot store"):
        skewed.to_file(tmp_path / "a.yaml")
    endless = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]])
    with pytest.raises(rs.errors.FileError, match="COLMAP needs the size of the image"):
        endless.to_file(tmp_path / "a.txt")
    for path in (tmp_path / "a.json", None):
        with pytest.raises(
            rs.errors.FileError, match=r"a name that ends in .yaml, .yml, .xml, .txt"
        ):
            endless.to_file(path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "call, reason",
    [
        (lambda c: c.resized(0, 10), "size must be a whole number from 1 to 1000000"),
        (lambda c: c.resized(32.5, 24), "size must be a whole number from 1 to 1000000"),
        (lambda c: c.cropped(-1, 0, 10, 10), "left must be a whole number from 0 on"),
        (lambda c: c.cropped(10, 0, 640, 480), "640 x 480 pixels from (10, 0) on exceed the image"),
        (lambda c: rs.Camera(c.K).resized(3, 2), "a camera without a size cannot be resized"),
        (lambda c: rs.Camera(c.K).cropped(0, 0, 3, 2), "a camera without a size cannot be cropped"),
    ],
)
def test_a_wrong_size_is_refused(call, reason, camera):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        call(camera)


def test_a_file_that_names_its_model_has_no_other(tmp_path):
    path = tmp_path / "camera.xml"
    path.write_text(xml(MATRIX + "<fisheye_model>1</fisheye_model>"))
    assert rs.Camera.from_file(path, lens="fisheye").lens == "fisheye"
    with pytest.raises(rs.errors.FileError, match="lens='perspective', but the file has a fisheye"):
        rs.Camera.from_file(path, lens="perspective")
    path.write_text("1 PINHOLE 640 480 500 500 320 240\n")
    with pytest.raises(rs.errors.FileError, match="lens='fisheye', but the file has a perspective"):
        rs.Camera.from_file(path, lens="fisheye")


@pytest.mark.parametrize(
    "call",
    [
        lambda lens: rs.Camera(K_3, lens=lens),
        lambda lens: rs.Camera(K_3).revised(lens=lens),
        lambda lens: rs.Camera.from_file("a.xml", lens=lens),
    ],
)
@pytest.mark.parametrize(
    "lens, words",
    [
        (
            "fisheyes",
            "lens: no model 'fisheyes'; did you mean 'fisheye'? models: perspective, fish",
        ),
        ("Fisheye", "lens: the model 'Fisheye' has the name 'fisheye' here"),
        ("equidistant", "lens: the model 'equidistant' has the name 'fisheye' here"),
        ("radtan", "lens: the model 'radtan' has the name 'perspective' here"),
        ("omni", "lens: no model 'omni'; models: perspective, fisheye"),
        (3, "lens: no model 3; models: perspective, fisheye"),
    ],
)
def test_an_unknown_model_is_refused(call, lens, words):
    with pytest.raises(rs.errors.InputError, match=re.escape(words)):
        call(lens)


@pytest.mark.parametrize("lens", [(0.1,), (0.1, 0, 0, 0, 0), [0] * 8, [0] * 12, [[0, 0], [0, 0]]])
def test_a_fisheye_has_four_coefficients(lens):
    with pytest.raises(rs.errors.InputError, match=r"distortion: expected (0 or 4|one row)"):
        rs.Camera(K_3, distortion=lens, lens="fisheye")
