"""The shipped scenarios end as their comments claim."""

import numpy as np
import pytest

import robsim as rs

ENDINGS = {  # of those that do not converge
    "camera_law_stalls": "LOCAL_MINIMUM",
    "desired_through_the_target": "BEHIND_CAMERA",
    "joint_friction": "TIME_LIMIT",
    "local_minimum": "LOCAL_MINIMUM",
    "marks_that_lie": "TIME_LIMIT",
    "noise_floor": "TIME_LIMIT",
    "pbvs_loses_target": "OUT_OF_IMAGE",
    "tilted_square": "LOCAL_MINIMUM",
    "uneven_depth": "LOCAL_MINIMUM",
    "unknown_payload": "TIME_LIMIT",
    "velocity_loop": "TIME_LIMIT",
}


def run_of(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes).run()


MISSIONS = ("inspection_a", "inspection_b")  # see test_inspection.py


def outcome(run):
    return rs.Outcome(int(run.outcome)).name


@pytest.mark.parametrize("name", [name for name in rs.examples.names() if name not in MISSIONS])
@pytest.mark.few(18)
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


@pytest.mark.full
def test_a_long_exposure_blurs_the_dots_of_a_fast_camera():
    fast = run_of("detected_dots", "task.gain=10")
    assert outcome(fast) == "CONVERGED" and float(fast.end_time) == pytest.approx(0.48)
    blurred = run_of("detected_dots", "task.gain=10", "cameras.camera.optics.exposure=40 ms")
    assert outcome(blurred) == "OUT_OF_IMAGE" and float(blurred.end_time) == pytest.approx(0.64)
    assert "without the blur by motion" in str(rs.explain(blurred))


CORNERS = 0.06 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])  # centres of discs in metres


def project_discs(T_o_c, radius):
    """The centres of the ellipses of discs, the images of their centres, and their depths.

    The image of a circle is the conic of inv(H)' diag(1, 1, -radius^2) inv(H), for the homography H
    of the plane with the origin at the centre of the disc.
    """
    R, t = T_o_c[:3, :3].T, -T_o_c[:3, :3].T @ T_o_c[:3, 3]
    centres, points, depths = [], [], []
    for x, y in CORNERS:
        H = np.column_stack([R[:, :2], R @ [x, y, 0] + t])
        conic = np.linalg.inv(H).T @ np.diag([1, 1, -(radius**2)]) @ np.linalg.inv(H)
        centres.append(-np.linalg.solve(conic[:2, :2], conic[:2, 2]))
        points.append(H[:2, 2] / H[2, 2])
        depths.append(H[2, 2])
    return np.array(centres), np.array(points), np.array(depths)


def rest_of_discs(radius):
    """The distance (m) and the angle (rad) from the goal at which the law commands nothing."""
    scenario = rs.load_scenario(rs.examples.path("disc_centers"))
    goal = scenario.scene.pose("camera", scenario.task.goal.q).matrix
    _, wanted, _ = project_discs(goal, radius)
    T = goal
    for _ in range(20):
        s, _, Z = project_discs(T, radius)
        x, y = s.T
        along_x = [-1 / Z, 0 * x, x / Z, x * y, -(1 + x * x), y]
        along_y = [0 * x, -1 / Z, y / Z, 1 + y * y, -x * y, -x]
        L = np.stack([np.column_stack(along_x), np.column_stack(along_y)], axis=1).reshape(8, 6)
        v = -np.linalg.pinv(L) @ (s - wanted).ravel()
        T = T @ rs.Pose.at(*v[:3], rotvec=v[3:]).matrix
    assert np.abs(v).max() < 1e-12
    off = rs.Pose(np.linalg.inv(goal) @ T)
    return np.linalg.norm(off.position), np.linalg.norm(off.rotvec)


@pytest.mark.full
@pytest.mark.parametrize("radius", [0.02, 0.01])
def test_the_centres_of_discs_move_the_end_by_their_closed_form(radius):
    run = run_of("disc_centers", f"objects.sheet.dots.radius={radius} m")
    distance, angle = rest_of_discs(radius)
    assert float(run.distance_to_goal) == pytest.approx(distance, abs=2e-5)
    assert float(run.angle_to_goal) == pytest.approx(angle, abs=np.radians(0.003))
    assert distance == pytest.approx(2.224 * radius**2, rel=1e-3)


@pytest.mark.full
def test_dots_without_the_shift_of_their_centres_end_at_the_goal():
    run = run_of("disc_centers", "task.detector.unbiased=true")
    assert float(run.distance_to_goal) < 6e-5


NEAR = {  # poses of the poster in camera axes, metres and a rotation vector in degrees
    "tilted": (0, 0, 1.2, 15, -5, 20),
    "near": (0.02, 0.02, 1.1, 5, 5, 10),
    "5 cm aside": (0.05, 0, 1, 0, 0, 0),
}
FAR = {"10 cm aside": (0.1, 0, 1, 0, 0, 0), "40 degrees of roll": (0, 0, 1, 0, 0, 40)}


def run_of_poster(pose, *changes):
    """The run of `photometric` from a pose of the poster."""
    scenario = rs.load_scenario(rs.examples.path("photometric"), changes)
    start = rs.Pose.at(*pose[:3], rotvec=np.radians(pose[3:])).inv().q
    return scenario.with_(start=start).run()


@pytest.mark.parametrize("pose", NEAR.values(), ids=NEAR)
def test_grey_values_alone_lead_to_the_goal_from_near_starts(pose):
    run = run_of_poster(pose)
    assert outcome(run) == "CONVERGED" and float(run.distance_to_goal) < 4e-4


@pytest.mark.parametrize("pose", FAR.values(), ids=FAR)
def test_grey_values_lead_nowhere_from_far_starts(pose, tmp_path):
    run = run_of_poster(pose)
    assert outcome(run) == "NOTHING_IN_VIEW" and float(run.distance_to_goal) > 0.5
    rs.save_run(run, tmp_path / "run.nc")
    assert rs.open_run(tmp_path / "run.nc").outcome == run.outcome


def test_coarse_pixels_lead_to_the_goal_from_a_large_roll():
    run = run_of_poster(FAR["40 degrees of roll"], "task.features.level=3")
    assert outcome(run) == "CONVERGED" and float(run.distance_to_goal) < 5e-4


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
