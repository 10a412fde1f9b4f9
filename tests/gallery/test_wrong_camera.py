"""The gallery: a focal length and a mounting that are wrong, and goals shown or computed."""

import numpy as np
import pytest

import robsim as rs

SCHEMES = {
    "pbvs": ["task.kind=pbvs"],
    "pbvs camera": ["task.kind=pbvs", "task.form=camera"],
    "ibvs pixels": ["task.kind=ibvs", "task.features=pixels"],
    "ibvs points": ["task.kind=ibvs"],
}
SHOWN = 'task.goal={position="0, 0, -1 m"}'
TILTED = 'task.goal.computed.rotvec="30, 0, 0 deg"'


def run_of(*changes):
    return rs.load_scenario(rs.examples.path("calibration_errors"), changes).run()


def outcome(run):
    return rs.Outcome(int(run.outcome)).name


def target(run):
    """Pose of the target in the camera at the end."""
    return rs.Pose(run.camera_pose.dropna("time").values[-1]).inv()


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_goal_that_was_shown_leaves_no_error(scheme):
    """Convergence ends at 1e-5 or 0.01 px of error, which is some 1e-4 m at a metre."""
    run = run_of(*scheme, SHOWN)
    assert outcome(run) == "CONVERGED"
    np.testing.assert_allclose(target(run).position, [0, 0, 1], atol=2e-4)
    np.testing.assert_allclose(target(run).rotvec, 0, atol=2e-4)


@pytest.mark.parametrize("ratio", [0.9, 1.1, 1.2])
@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_computed_goal_is_missed_by_the_ratio_of_focal_lengths(scheme, ratio):
    """The image of a centred parallel target at Z* is f X / Z* for the true f, and is taken for
    the image at Z* fhat / f: every scheme stops at Z* f / fhat.
    """
    run = run_of(*scheme, f"belief.cameras.camera.focal={500 * ratio}")
    assert outcome(run) == "CONVERGED"
    np.testing.assert_allclose(target(run).position, [0, 0, 1 / ratio], atol=2e-4)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_a_wrong_mounting_bends_the_way_and_not_its_end(scheme):
    """Goals in camera axes, shown or computed, do not depend on how the camera is mounted."""
    wrong, right = run_of(*scheme), run_of(*scheme, 'belief.cameras.camera.rpy="0, 0, 0 deg"')
    np.testing.assert_allclose(target(wrong).position, target(right).position, atol=1e-4)
    both = min(wrong.sizes["time"], right.sizes["time"])
    apart = wrong.q.values[:both, :3] - right.q.values[:both, :3]
    assert np.nanmax(np.linalg.norm(apart, axis=1)) > 0.01


def test_a_tilted_goal_cannot_be_reached_and_only_ibvs_notices():
    """No pose shows the image that was computed. IBVS stalls with an error of pixels; PBVS reads
    exactly the pose of the computed image, and reports convergence, at the same wrong place.
    """
    image, pose = run_of(*SCHEMES["ibvs pixels"], TILTED), run_of(TILTED)
    assert outcome(image) == "LOCAL_MINIMUM"
    assert float(image.error_norm.dropna("time")[-1]) == pytest.approx(2.516, abs=0.01)
    assert outcome(pose) == "CONVERGED"
    for run in (image, pose):
        np.testing.assert_allclose(target(run).position, [0, 0.0019, 0.9149], atol=5e-4)
        assert np.degrees(target(run).rotvec[0]) == pytest.approx(29.1, abs=0.05)
