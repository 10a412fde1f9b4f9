"""A calibration from the pictures of a camera."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.calibration import sample_viewpoints, simulate_views
from robsim.vision import DotDetector, DotPattern, Optics


@pytest.fixture(scope="module")
def bench():
    """The bench of the examples, with a pattern of dots and a wrong belief of its camera."""
    bench = rs.load_scenario(rs.examples.path("calibration_bench"))
    board = bench.scene.object("board")
    dots = DotPattern.grid(6, 5, spacing=0.03, radius=0.005)
    pattern = rs.Object("board", dots=dots, pose=board.pose, on=board.on)
    eye = replace(bench.scene.camera(), optics=Optics(read_noise=1.0))
    scene = rs.Scene(bench.scene.robots, pattern, eye)
    task = rs.IBVS(rs.GoalPose(rs.Pose.at(0, 0, 0.5)), belief=scene.believe(focal=1.01))
    return rs.Experiment(scene, task, bench.start)


@pytest.mark.full
def test_dots_in_pictures_calibrate_a_camera(bench):
    start = rs.starts.LookAt("board", distance=(0.4, 0.6))
    q = sample_viewpoints(bench, 12, start, seed=2)
    views = simulate_views(bench, q, detector="dots")
    exact = simulate_views(bench, q)
    errors = (views.pixels - exact.pixels)[np.isfinite(views.pixels)]
    assert 0.001 < np.sqrt(np.mean(errors**2)) < 0.06
    with pytest.warns(rs.errors.FitWarning, match="off"):  # a centroid is not the exact centre
        found = rs.calibrate(views, ["focal", "center"])
    K = found.scene.camera().camera.K
    np.testing.assert_allclose(K, bench.scene.camera().camera.K, rtol=0, atol=0.6)


@pytest.mark.full
def test_unbiased_dots_calibrate_a_camera_without_a_doubt(bench):
    q = sample_viewpoints(bench, 12, rs.starts.LookAt("board", distance=(0.4, 0.6)), seed=2)
    views = simulate_views(bench, q, detector=DotDetector(unbiased=True))
    errors = views.pixels - simulate_views(bench, q).pixels
    assert np.sqrt(np.nanmean(errors**2)) < 0.01
    K = rs.calibrate(views, ["focal", "center"]).scene.camera().camera.K
    np.testing.assert_allclose(K, bench.scene.camera().camera.K, rtol=0, atol=0.3)


def test_a_detector_that_cannot_see_the_marks_is_refused(bench):
    q = np.zeros((3, bench.scene.nq))
    with pytest.raises(rs.errors.InputError, match="TagTracker needs a Tag"):
        simulate_views(bench, q, detector="tag_tracker")
    with pytest.raises(rs.errors.InputError, match="no mark detector 'dot'"):
        simulate_views(bench, q, detector="dot")
