"""Faults in the views of a calibration: an error, or a warning of the fit."""

import re
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.analysis.explanation.counterfactuals import remove_joint_limits
from robsim.calibration import model_fit

ALSO = ["focal", "center"]


@pytest.fixture(scope="module")
def bench():
    return rs.load_scenario(rs.examples.path("calibration_bench"))


@pytest.fixture(scope="module")
def views(bench):
    look = rs.starts.LookAt("board", distance=(0.3, 0.9), cone=0.9, aside=0.1)
    return rs.calibration.simulate_views(
        bench, rs.calibration.sample_viewpoints(bench, 10, look, seed=3)
    )


def sized(views, times):
    """The scene of views with a board of another size."""
    board = views.scene.object("board")
    return views.scene.replacing(replace(board, marks=board.marks * times))


def test_pixels_in_another_order_are_outside_the_image(views):
    where = (
        r"pixels: mark 0 of view 9 is at \(528\.758, 981\.175\), outside the image of 1280 x 960"
    )
    with pytest.raises(rs.errors.InputError, match=where):
        rs.calibration.CalibrationViews(views.scene, views.q, views.pixels[..., ::-1])


@pytest.mark.parametrize(("u", "fits"), [(-2.9, True), (-3.1, False), (1282.9, True), (1283.1, 0)])
def test_a_detector_may_place_a_mark_some_pixels_outside(views, u, fits):
    pixels = views.pixels.copy()
    pixels[2, 5, 0] = u
    if fits:
        assert rs.calibration.CalibrationViews(views.scene, views.q, pixels).pixels[2, 5, 0] == u
    else:
        with pytest.raises(
            rs.errors.InputError, match=r"mark 5 of view 2 is at .* outside the image"
        ):
            rs.calibration.CalibrationViews(views.scene, views.q, pixels)


def test_a_camera_without_a_size_sees_marks_anywhere(views):
    eye = views.scene.camera()
    endless = views.scene.replacing(replace(eye, camera=replace(eye.camera, size=None)))
    pixels = views.pixels[..., ::-1]
    np.testing.assert_array_equal(
        rs.calibration.CalibrationViews(endless, views.q, pixels).pixels, pixels
    )


def test_marks_that_noise_moves_off_the_image_are_not_seen(bench, views):
    """The marks that are left are where noise has put them, in the image."""
    loud = bench.at("sensing.noise", 60.0)
    seen = rs.calibration.simulate_views(loud, views.q).pixels
    lost = np.isnan(seen[..., 0])
    assert lost.any() and not lost.all()
    assert np.nanmin(seen) >= -3.0 and np.nanmax(seen[..., 0]) <= 1283.0
    scale = (seen - views.pixels)[~lost] / 60.0
    assert abs(np.sqrt(np.mean(scale**2)) - 1.0) < 0.1


def test_joints_in_degrees_are_outside_their_limits(views):
    text = (
        r"q: joint 'shoulder' in view 0 is -29\.1\d+ rad, outside .* 6\.28319\] rad: in degrees\?"
    )
    with pytest.raises(rs.errors.InputError, match=text):
        rs.calibration.CalibrationViews(views.scene, np.degrees(views.q), views.pixels)


@pytest.mark.parametrize(("over", "fits"), [(0.09, True), (0.11, False)])
def test_encoders_may_measure_a_little_more_than_the_limits(views, over, fits):
    q = views.q.copy()
    q[4, 1] = views.scene.limits[1, 1] + over
    if fits:
        assert rs.calibration.CalibrationViews(views.scene, q, views.pixels).q[4, 1] == q[4, 1]
    else:
        with pytest.raises(
            rs.errors.InputError, match=r"joint 'upper_arm' in view 4 is 6\.39319 rad"
        ):
            rs.calibration.CalibrationViews(views.scene, q, views.pixels)


@pytest.mark.full
def test_marks_behind_the_camera_are_reported_before_any_least_squares(views, capfd):
    """Of a robot without limits; LAPACK itself would print."""
    free = remove_joint_limits(rs.Experiment(views.scene, rs.IBVS())).scene
    there = rs.calibration.CalibrationViews(free, np.degrees(views.q), views.pixels)
    with pytest.raises(
        rs.errors.InputError, match=r"mark \d+ of view \d+ is behind the camera in the"
    ):
        rs.calibrate(there, ALSO)
    assert capfd.readouterr() == ("", "")


def test_least_squares_that_fail_report_a_remedy(views, monkeypatch):
    def fails(*_):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(model_fit, "minimise", fails)
    text = (
        r"views: the fit failed \('SVD did not converge'\): do joints \(rad, m\) and views belong"
    )
    with pytest.raises(rs.errors.InputError, match=text):
        rs.calibrate(views)


def mixed_up(views):
    pixels = views.pixels.copy()
    pixels[3] = pixels[4]
    return rs.calibration.CalibrationViews(views.scene, views.q, pixels)


WRONG = {
    "a board 10 % too large": lambda v: rs.calibration.CalibrationViews(
        sized(v, 1.1), v.q, v.pixels
    ),
    "a board in mm": lambda v: rs.calibration.CalibrationViews(sized(v, 1e3), v.q, v.pixels),
    "signs of the joints": lambda v: rs.calibration.CalibrationViews(v.scene, -v.q, v.pixels),
    "two views that are one": mixed_up,
    "marks by columns": lambda v: rs.calibration.CalibrationViews(
        v.scene, v.q, v.pixels.reshape(-1, 5, 7, 2).swapaxes(1, 2).reshape(-1, 35, 2)
    ),
}


@pytest.mark.full
@pytest.mark.parametrize("wrong", WRONG)
def test_a_misfit_is_warned_of_and_printed_with_the_worst_view(views, wrong):
    with pytest.warns(rs.errors.FitWarning) as record:
        found = rs.calibrate(WRONG[wrong](views), ALSO)
    if wrong == "two views that are one":
        assert "worst in view 3 " in found.misfit
    text, worst = str(record[0].message), np.nanmean(np.square(found.residuals), (1, 2)).argmax()
    rms = float(re.match(r"the marks are ([\d.]+) px off \(rms\)", text)[1])
    assert rms > 3.0 and abs(rms / found.rms - 1.0) < 0.01
    assert f"worst in view {worst} (" in text and record[0].filename == __file__
    assert str(found).splitlines()[1] == text == found.misfit and text in found._repr_html_()


@pytest.mark.full
def test_noise_that_is_given_is_no_misfit(bench, views):
    """5 pixels of noise are too much unless they are declared as noise."""
    loud = rs.calibration.simulate_views(bench.at("sensing.noise", 5.0), views.q)
    assert rs.calibrate(loud, ALSO, noise=5.0).misfit == ""
    assert rs.calibrate(views, ALSO).misfit == ""
    with pytest.warns(rs.errors.FitWarning, match="the marks are 4.* px off"):
        rs.calibrate(loud, ALSO)


def free_camera(views):
    """The same views by a camera whose pose is measured, as from a robot without a model."""
    eye, board = views.eye, views.thing
    hand = rs.robots.free_camera()
    link = f"{hand.name}.{hand.links[-1].name}"
    scene = rs.Scene([hand], [board], [replace(eye, on=link)])
    poses = views.scene.pose(views.eye.on, views.q)
    return rs.calibration.CalibrationViews(scene, np.asarray(poses.q), views.pixels)


def changed_poses(views, position=None, turn=None, inverse=False):
    """Views with the poses of the hand as a user gives them by mistake."""
    q = views.q.copy()
    if inverse:
        q = np.asarray(rs.Pose.from_quaternion(q[:, :3], q[:, 3:]).inv().q)
    if position is not None:
        q[:, :3] *= position
    if turn is not None:
        q[:, 3:] = q[:, 3:][:, turn]
    return replace(views, q=q)


POSE_FAULTS = {
    "scalar first": (
        lambda v: changed_poses(v, turn=[3, 0, 1, 2]),
        r"quaternions read as \(w, x, y, z\)",
    ),
    "inverse": (lambda v: changed_poses(v, inverse=True), "inverse poses"),
}


@pytest.mark.full
def test_wrong_poses_of_a_hand_are_named(views):
    given = free_camera(views)
    assert rs.calibrate(given, ALSO).misfit == ""
    for make, cause in POSE_FAULTS.values():
        with pytest.warns(rs.errors.FitWarning, match=cause):
            rs.calibrate(make(given), ALSO)


def test_views_without_a_fit_are_explained(views):
    """Positions in millimetres put the marks behind the camera in the closed-form estimate."""
    text = r"behind the camera .* \(marks 999 times as large \(positions in millimetres\?\) give"
    with pytest.raises(rs.errors.InputError, match=text):
        rs.calibrate(changed_poses(free_camera(views), position=1e3), ALSO)
