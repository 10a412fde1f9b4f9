"""Wrong tags, boards and targets are refused; parts that need no other program are correct."""

import re
import sys

import numpy as np
import pytest

import robsim as rs

TAG = rs.vision.Tag("tag36h11", 7, size=0.1)


@pytest.mark.parametrize(
    "make, reason",
    [
        (lambda: rs.vision.Tag("tag36h12", 0, 0.1), "no family 'tag36h12' of tags; did you"),
        (lambda: rs.vision.Tag(None, 0, 0.1), "no family None of tags; families: tag16h5"),
        (lambda: rs.vision.Tag("tag36h11", 587, 0.1), "id of a tag of tag36h11 must be below 587"),
        (
            lambda: rs.vision.Tag("tag36h11", -1, 0.1),
            "id of a tag of tag36h11 must be a whole number",
        ),
        (
            lambda: rs.vision.Tag("tag36h11", 1.5, 0.1),
            "id of a tag of tag36h11 must be a whole number",
        ),
        (
            lambda: rs.vision.Tag("tag36h11", 0, 0),
            "size of a tag in metres must be a positive number",
        ),
        (lambda: rs.vision.Tag("tag36h11", 0, np.nan), "size of a tag in metres: nan"),
        (
            lambda: rs.vision.Board("DICT_4X4_50", 1, 4, 0.03, 0.02),
            "columns of a board must be a whole",
        ),
        (lambda: rs.vision.Board("DICT_4X4_50", 5, 4, 0.03, 0.04), "tag of 0.04 m: larger tha"),
        (
            lambda: rs.vision.Board("DICT_4X4_50", 5, 4, -1, 0.02),
            "square of a board in metres must be",
        ),
        (lambda: rs.vision.Board("DICT_4X4_50", 20, 20, 0.03, 0.02), "200 white squares, but DICT"),
        (lambda: rs.vision.TagDetector([]), "targets: expected at least one Tag or Board"),
        (lambda: rs.vision.TagDetector(TAG), "targets: expected a list of Tag and Board, got"),
        (lambda: rs.vision.TagDetector([TAG, 3]), "targets: expected a Tag or a Board, got 3"),
        (
            lambda: rs.vision.TagDetector([TAG, rs.vision.Tag("tag36h11", 7, 0.2)]),
            "both have tag 7 of tag36h11",
        ),
        (
            lambda: rs.vision.render_targets(rs.Camera(np.eye(3)), {}),
            "camera: expected a Camera with a size",
        ),
        (lambda: TAG.picture(0), "pixels must be a whole number from 1 on"),
        (lambda: TAG.picture(9_000), "pixels of a side of the picture must be below 10000"),
    ],
)
def test_it_is_refused(make, reason):
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        make()


def test_possible_millimetres_are_warned_of():
    with pytest.warns(
        rs.errors.UnitWarning, match="size of a tag in metres: 80 looks like mil"
    ) as record:
        rs.vision.Tag("tag36h11", 7, size=80)
    assert record[0].filename == __file__ and str(record[0].message).endswith("80 mm is 0.08")
    with pytest.warns(
        rs.errors.UnitWarning, match="square of a board in metres: 30 looks like"
    ) as record:
        rs.vision.Board("DICT_4X4_50", 5, 4, 30.0, 20.0)
    assert len(record) == 1
    assert rs.vision.Tag("tag36h11", 7, size=10.0).size == 10.0


def test_wrong_targets_to_render_are_refused(camera):
    with pytest.raises(
        rs.errors.InputError, match="targets: expected poses by Tag, Board or DotPattern, got"
    ):
        rs.vision.render_targets(camera, {"tag": rs.Pose.at()})
    with pytest.raises(rs.errors.InputError, match="pose of tag36h11_7"):
        rs.vision.render_targets(camera, {TAG: 3})
    with pytest.raises(rs.errors.InputError, match="samples must be a whole number from 1 on"):
        rs.vision.render_targets(camera, {}, samples=0)


def test_an_image_of_nothing_is_even(camera):
    image = rs.vision.render_targets(camera.resized(32, 24), {})
    assert image.shape == (24, 32) and (image == 128).all()


def test_marks_are_the_corners_of_the_black_square():
    assert TAG.marks[:, :2].tolist() == [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]
    assert TAG.pitch == 0.0125 and TAG.paper.tolist() == [[-0.0625] * 2, [0.0625] * 2]
    assert (
        rs.vision.Tag("tag36h11", 7.0, size=0.1) == TAG
        and len({TAG, rs.vision.Tag("tag36h11", 8, 0.1)}) == 2
    )


def test_a_missing_part_is_reported(monkeypatch):
    """Each extra program by its name, with the command that installs it."""
    for name in ("cv2", "pyapriltags"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(
        rs.errors.InputError, match=r"AprilTags need pyapriltags: pip install 'robsim\[vi"
    ):
        rs.vision.TagDetector([TAG])
    with pytest.raises(
        rs.errors.InputError, match=r"tags need OpenCV: pip install 'robsim\[vision\]'"
    ):
        rs.vision.TagDetector([rs.vision.Tag("DICT_4X4_50", 0, 0.1)])


def test_yaml_without_its_reader_is_reported(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "yaml", None)
    (tmp_path / "a.yaml").write_text("K: 3\n")
    with pytest.raises(
        rs.errors.FileError, match=r"YAML needs PyYAML: pip install 'robsim\[vision\]'"
    ):
        rs.Camera.from_file(tmp_path / "a.yaml")
