"""How far from its goal a run ended, in metres and radians, against closed forms."""

import numpy as np
import pytest

import robsim as rs

SQUARE = 0.25 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GOAL = rs.Pose.at(0, 0, -1)


def ends(run):
    return float(run.distance_to_goal), float(run.angle_to_goal)


@pytest.mark.parametrize("record", ["all", "summary"])
def test_a_run_reports_the_distance_of_its_end_from_its_goal(free_scene, record):
    """Of a start that is cut off after one period under a tiny gain, that is the start itself."""
    start = GOAL @ rs.Pose.at(0.1, -0.2, -0.2, rotvec=(0.1, 0.2, -0.2))
    how = {"dt": 0.01, "duration": 0.01, "record": record}
    run = rs.simulate(free_scene(SQUARE), rs.IBVS(GOAL, gain=1e-12), start, **how)
    assert ends(run) == pytest.approx((0.3, 0.3), rel=1e-9)
    np.testing.assert_allclose(run.goal_pose, GOAL.matrix, atol=1e-15)
    assert run.goal_pose.attrs["frame"] == run.mark_camera.values[0]
    assert (run.distance_to_goal.units, run.angle_to_goal.units) == ("m", "rad")


def test_a_batch_has_the_bits_of_its_runs_alone(free_scene):
    rng = np.random.default_rng(1)
    starts = (GOAL @ rs.Pose.exp(rng.normal(size=(5, 6)) * 0.1)).q
    scene, task = free_scene(SQUARE), rs.IBVS(GOAL)
    run = rs.simulate(scene, task, starts, duration=1)
    for i, start in enumerate(starts):
        alone = rs.simulate(scene, task, start, duration=1)
        assert ends(run.isel(run=i)) == ends(alone)
        np.testing.assert_array_equal(run.goal_pose[i], alone.goal_pose)


def test_a_goal_pose_agrees_with_the_camera_to_the_target(free_scene):
    away = rs.Pose.at(0, 0, 0.9, rotvec=(0, 0, 0.3))  # T_c_o at the goal
    run = rs.simulate(free_scene(SQUARE), rs.PBVS(rs.GoalPose(away)), GOAL, dt=0.01, duration=0.01)
    np.testing.assert_allclose(run.goal_pose, away.inv().matrix, atol=1e-15)
    # of the first period a hundredth of the way is gone
    assert ends(run) == pytest.approx((0.099, 0.297), rel=1e-2)


def test_a_goal_of_numbers_has_no_pose(free_scene):
    given = rs.IBVS(rs.GoalFeatures(SQUARE[:, :2].ravel()))
    run = rs.simulate(free_scene(SQUARE), given, GOAL @ rs.Pose.at(0.1, 0, 0), duration=1)
    assert np.isnan(ends(run)).all() and np.isnan(run.goal_pose).all()


def test_where_the_camera_stands_still_it_is_the_target_that_has_a_goal():
    fly = rs.Robot(
        "fly", [rs.joints.Link("base"), rs.joints.Link("body", "base", rs.joints.Joint("floating"))]
    )
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)))
    scene = rs.Scene(fly, rs.Object("square", marks=SQUARE, on="fly.body"), eye)
    goal, start = rs.Pose.at(0, 0, 1), rs.Pose.at(0, 0.3, 1.4, rotvec=(0.2, 0, 0))
    run = rs.simulate(scene, rs.PBVS(goal, gain=1e-12), start, dt=0.01, duration=0.01)
    assert run.goal_pose.attrs["frame"] == "square"
    np.testing.assert_allclose(run.goal_pose, goal.matrix, atol=1e-15)
    assert ends(run) == pytest.approx((0.5, 0.2), rel=1e-9)


def test_tools_have_goals_too():
    """A plane arm of two links of 1 m, at 0 and on its way to a quarter turn of its shoulder."""
    arm = rs.robots.planar_2r()
    scene, zero = rs.Scene(arm), np.zeros(2)
    lengths = arm.fk(zero)[0, 3]
    there = rs.FollowJoints(to=[np.pi / 2, 0], duration=1.0)
    run = rs.simulate(scene, there, zero, dt=0.5, duration=0.5)
    left = np.pi / 2 - float(run.q_end[0])
    assert ends(run) == pytest.approx((2 * lengths * np.sin(left / 2), left))
    done = rs.simulate(scene, there, zero, duration=1.5)
    assert ends(done) == pytest.approx((0, 0), abs=1e-6)
    place = arm.fk([0.4, 0.6])[:3, 3]
    path = rs.FollowPath(place, mask="position", duration=1.0)
    run = rs.simulate(scene, path, [0.1, 0.5], dt=0.1, duration=0.1)
    off = np.linalg.norm(arm.fk(run.q_end.values)[:3, 3] - place)
    assert float(run.distance_to_goal) == pytest.approx(off) and np.isnan(run.angle_to_goal)


def test_two_marks_leave_motions_free_and_explain_reports_it(free_scene):
    task = rs.IBVS(GOAL)
    start = GOAL @ rs.Pose.at(0.1, 0.05, 0, rotvec=(0.1, 0.1, 0))
    with pytest.warns(rs.errors.RankWarning):
        run = rs.simulate(free_scene(SQUARE[:2]), task, start, duration=15)
    assert int(run.outcome) == rs.Outcome.CONVERGED and run.goal_pose.attrs["free_motions"] == 2
    assert float(run.distance_to_goal) > 0.01
    message = str(rs.explain(run, trials=False))
    assert "The features leave 2 motions of the joints free" in message
