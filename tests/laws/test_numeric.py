"""L of a feature without `compute_interaction`, by moving the camera a little."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.features.numeric_interaction import (
    compute_interaction,
    difference_interaction,
    displace_camera,
)
from robsim.features.points import PixelPoints, Points
from robsim.features.pose_error import ThetaU, Translation
from robsim.features.stereo_points import StereoPoints
from robsim.testing import _RandomViews

BUILT_IN = pytest.mark.parametrize(
    "feature",
    [Points(), PixelPoints(), ThetaU(), Translation(), Translation("camera"), StereoPoints()],
    ids=repr,
)


def views(feature, runs=30):
    return _RandomViews.random(5, 12, runs)


@BUILT_IN
def test_differences_are_the_interaction_matrix(feature):
    seen = views(feature).observe(feature)
    L = feature.interaction(seen)
    assert np.abs(difference_interaction(feature, seen) - L).max() < 1e-9 * np.abs(L).max()
    np.testing.assert_array_equal(compute_interaction(feature, seen), L)


@BUILT_IN
def test_a_run_alone_has_the_bits_that_it_has_in_a_batch(feature):
    both = views(feature)
    together = difference_interaction(feature, both.observe(feature))
    for b in range(30):
        alone = difference_interaction(feature, both.select_runs(slice(b, b + 1)).observe(feature))
        np.testing.assert_array_equal(alone[0], together[b])


def test_a_pose_is_fitted_anew_wherever_its_guess_is():
    seen = views(ThetaU()).observe(ThetaU())
    off = replace(seen, guess_last=seen.guess_last + [[[0]] * 3 + [[0.05]]] * 3)
    L = ThetaU().interaction(seen)
    assert np.abs(difference_interaction(ThetaU(), off) - L).max() < 1e-8 * np.abs(L).max()


@pytest.mark.parametrize("axis", range(6))
def test_the_predicted_view_is_the_view_of_the_moved_camera(axis):
    """For both cameras of a pair, one of them with a lens; steps of any size."""
    here, step = views(StereoPoints()), 0.1
    twist = step * np.eye(6)[axis]
    said, truth = (
        displace_camera(here.observe(StereoPoints()), axis, step),
        here.move_camera(twist).observe(StereoPoints()),
    )
    for a, b in ((said, truth), (said.other, truth.other)):
        np.testing.assert_allclose(a.pixels_last, b.pixels_last, rtol=0, atol=1e-9)
        np.testing.assert_allclose(a.points_last, b.points_last, rtol=0, atol=1e-12)
        np.testing.assert_allclose(a.depth_last, b.depth_last, rtol=0, atol=1e-13)
        np.testing.assert_allclose(a.guess_last, b.guess_last, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(said.between_last, truth.between_last)
    np.testing.assert_array_equal(said.model, truth.model)


class Depths:
    """A user's feature without an interaction matrix."""

    unit, tolerance = "m", 1e-5

    def measure(self, seen):
        return seen.depth


def test_a_feature_of_depth_gets_its_interaction_matrix():
    """Zdot = -vz - omega_x Y + omega_y X."""
    seen = views(Depths()).observe(Depths())
    X = np.concatenate([seen.points, np.ones((30, 5, 1))], axis=-1) * seen.depth[..., None]
    zero = np.zeros((30, 5))
    L = np.stack([zero, zero, zero - 1, -X[..., 1], X[..., 0], zero], axis=-1)
    np.testing.assert_allclose(compute_interaction(Depths(), seen), L, rtol=0, atol=1e-9)


class MeasuredPixels:
    """The measurement of the camera itself, through its lens, in plain NumPy."""

    unit, tolerance = "px", 0.01

    def measure(self, seen):
        return seen.pixels.reshape(len(seen.pixels), -1)


def test_pixels_through_a_lens_get_the_derivative_of_the_lens():
    straight = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    bent = rs.Camera(straight.K, distortion=(-0.2, 0.05, 1e-3, -5e-4))
    X = np.array([[[0.1, -0.2, 1.0], [0.3, 0.2, 1.4]]])
    seen = rs.features.Observation.of(bent.project(X, rs.Pose.at()), X[..., 2], bent)
    L, h = compute_interaction(MeasuredPixels(), seen)[0], 1e-4
    for axis, along in enumerate(np.eye(6)):
        ahead, behind = (bent.project(X, rs.Pose.exp(s * along)) for s in (h, -h))
        np.testing.assert_allclose(
            L[:, axis], (ahead - behind).ravel() / (2 * h), rtol=1e-6, atol=1e-4
        )
