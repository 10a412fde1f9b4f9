"""The shipped scenarios end as their comments claim."""

import numpy as np
import pytest

import robsim as rs

ENDINGS = {  # of those that do not converge
    "camera_law_stalls": "LOCAL_MINIMUM",
    "desired_through_the_target": "BEHIND_CAMERA",
    "local_minimum": "LOCAL_MINIMUM",
    "marks_that_lie": "TIME_LIMIT",
    "noise_floor": "TIME_LIMIT",
    "pbvs_loses_target": "OUT_OF_IMAGE",
    "tilted_square": "LOCAL_MINIMUM",
    "uneven_depth": "LOCAL_MINIMUM",
}


def run_of(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes).run()


MISSIONS = ("inspection_a", "inspection_b")  # see test_inspection.py


def outcome(run):
    return rs.Outcome(int(run.outcome)).name


@pytest.mark.parametrize("name", [name for name in rs.examples.names() if name not in MISSIONS])
def test_it_ends_as_its_comment_claims(name):
    assert outcome(run_of(name)) == ENDINGS.get(name, "CONVERGED")


def test_the_camera_law_stalls_on_the_rhino_where_the_joint_law_arrives():
    """Erratum 7: J^+ V = 0 with V not 0, at twice the error of the start."""
    stalled = run_of("camera_law_stalls")
    error = stalled.error_norm.dropna("time").values
    assert error[-1] > 2 * error[0]
    arrived = run_of("camera_law_stalls", "task.law=joint")
    assert outcome(arrived) == "CONVERGED"
    assert (np.diff(arrived.error_norm.dropna("time").values) < 0).all()


def test_robust_weights_leave_the_error_of_noise():
    """In mm, means from 10 s on: 24 with marks that lie, 4.2 weighted, 3.9 of noise; and ends."""

    def off(*changes):
        run = run_of("marks_that_lie", *changes)
        away = run.camera_pose.values[:, :3, 3] - [0, 0, -0.6]
        mean = np.linalg.norm(away, axis=1)[run.time.values > 10].mean()
        return 1e3 * mean, 1e3 * float(run.distance_to_goal)

    lying, weighted, noise = off(), off('task.weighting=["tukey"]'), off("sensing.outliers=0")
    np.testing.assert_allclose([lying[0], weighted[0], noise[0]], [24.0, 4.17, 3.90], rtol=0.01)
    np.testing.assert_allclose([lying[1], weighted[1]], [11.5, 2.68], rtol=0.01)


def test_a_long_exposure_blurs_the_dots_of_a_fast_camera():
    fast = run_of("detected_dots", "task.gain=10")
    assert outcome(fast) == "CONVERGED" and float(fast.end_time) == pytest.approx(0.48)
    blurred = run_of("detected_dots", "task.gain=10", "cameras.camera.optics.exposure=40 ms")
    assert outcome(blurred) == "OUT_OF_IMAGE" and float(blurred.end_time) == pytest.approx(0.64)
    assert "without the blur by motion" in str(rs.explain(blurred))


def test_feed_forward_keeps_the_plate_in_the_middle():
    """The lag without it is some hundred times the error with it."""
    known, none = (
        run_of("watching_head", f"task.feed_forward={how}").error_norm.values[-100:].max()
        for how in ("known", "none")
    )
    assert known < 1e-4 and none > 100 * known


def test_one_arm_can_do_the_work_of_two():
    one = run_of("second_robot", 'task.joints=["worker"]')
    assert outcome(one) == "CONVERGED"
    np.testing.assert_array_equal(np.nan_to_num(one.qd.values)[:, 6:], 0.0)


def test_a_unicycle_stands_still_askew_without_docking():
    with pytest.warns(rs.errors.RankWarning, match="cannot move sideways"):
        askew = run_of("unicycle_docking", "task.kind=ibvs")
    docked = run_of("unicycle_docking")
    assert outcome(askew) == "LOCAL_MINIMUM" and abs(askew.q_end[1]) > 0.01
    np.testing.assert_allclose(docked.q_end, 0.0, atol=1e-4)


def test_a_car_with_one_gain_for_all_cannot_turn_enough_as_it_slows_down():
    """It ends on its steering limit, the sign centimetres aside; with two gains it arrives."""
    stuck, arrived = run_of("car", "task.tasks.0.gain=0.5"), run_of("car")
    assert outcome(stuck) == "TIME_LIMIT" and outcome(arrived) == "CONVERGED"
    np.testing.assert_allclose(stuck.error.values[-1], [0.0247, 0.0004], atol=1e-4)
    assert stuck.q_end[3] == -0.4189 and abs(arrived.q_end[3]) < 0.003
