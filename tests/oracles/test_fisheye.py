"""Fisheye lenses against 60 digits: pixels, the inverse, the fold and the derivatives."""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.vision.pixel_measurement import pixel_rate_matrices

DATA = json.loads(Path(__file__).with_name("fisheye_mpmath.json").read_text(encoding="utf-8"))
CASES = {case["name"]: case for case in DATA["cameras"]}


def read_case(name):
    """A camera, points, their normalised coordinates and the stored numbers."""
    case = CASES[name]
    points = np.array(case["points"])
    camera = rs.Camera(case["K"], distortion=case["distortion"], lens="fisheye")
    return camera, points, points[:, :2] / points[:, 2:], case


@pytest.mark.parametrize("name", CASES)
def test_pixels_agree_to_the_last_digits(name):
    camera, points, _, case = read_case(name)
    pixels = camera.project(points, rs.Pose.at())
    np.testing.assert_allclose(pixels, case["pixels"], rtol=0, atol=5e-13)


@pytest.mark.parametrize("name", CASES)
def test_the_inverse_finds_the_ray_to_1e_12_rad(name):
    """Near the fold, where the image hardly moves with the ray, to the square root of 1e-16."""
    camera, _, x, case = read_case(name)
    found = camera.normalise(case["pixels"])
    angles = np.arctan(np.linalg.norm(x, axis=1))
    errors = np.linalg.norm(found - x, axis=1) / (1 + (x * x).sum(axis=1))
    near = angles > 0.99 * (case["fold"] or np.inf)
    assert errors[~near].max() < 1e-12
    assert errors.max() < 1e-8
    small = angles < 2e-3
    np.testing.assert_allclose(found[small], x[small], rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", CASES)
def test_the_valid_radius_is_the_fold(name):
    camera, _, _, case = read_case(name)
    radius = np.inf if case["fold"] is None else np.tan(case["fold"])
    assert camera.valid_radius == pytest.approx(radius, rel=1e-13)
    assert (camera.visibility(case["points"], rs.Pose.at()) == rs.vision.Visibility.IN_IMAGE).all()


@pytest.mark.parametrize("name", CASES)
def test_derivatives_agree_to_the_last_digits(name):
    camera, _, x, case = read_case(name)
    rates = np.array(case["rates"])
    errors = np.abs(pixel_rate_matrices(x, camera) - rates).max(axis=(1, 2))
    assert (errors < 2e-15 * np.abs(rates).max(axis=(1, 2)) + 1e-16).all()
