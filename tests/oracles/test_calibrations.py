"""Calibration files of OpenCV, read to the last digit, and its pixels of these cameras."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

DATA = json.loads(Path(__file__).with_name("calibrations_opencv.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", DATA["cases"], ids=lambda case: str(len(case["distortion"])))
def test_a_file_of_opencv_gives_its_camera_and_its_pixels(case, tmp_path):
    path = tmp_path / "calibration.data"  # the format follows from the content
    path.write_text(case["xml"], encoding="utf-8")
    camera = rs.Camera.from_file(path)
    assert camera.K.tolist() == case["K"] and camera.size == tuple(case["size"])
    assert list(camera.distortion) == case["distortion"][:8]
    pixels = camera.project(case["points"], rs.Pose.at())
    np.testing.assert_allclose(pixels, case["pixels"], rtol=0, atol=1e-9)
