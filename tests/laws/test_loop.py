"""Properties of the closed loop that hold for any numbers."""

import numpy as np
import pytest

import robsim as rs

SQUARE = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
START = rs.Pose.at(0.1, -0.05, -0.8, rotvec=(0.1, -0.1, 0.3))
GOAL = rs.Pose.at(0, 0, -0.6)


def outcome(run):
    return rs.Outcome(int(run.outcome))


@pytest.mark.parametrize(
    "features", [rs.features.Points(), rs.features.PixelPoints()], ids=lambda f: f.unit
)
def test_the_error_decays_exponentially_for_small_periods(free_scene, features):
    """Chapter, eqs. 7 and 8: with exact L mean-free of error, edot = -gain e near the goal."""
    scene = free_scene(SQUARE, K=[[800, 0, 320], [0, 820, 240], [0, 0, 1]])
    near = GOAL @ rs.Pose.exp([1e-3, -1e-3, 2e-3, 1e-3, 2e-3, -1e-3])
    task = rs.IBVS(goal=GOAL, features=features, gain=2.0)
    run = rs.simulate(scene, task, near, dt=1e-3, duration=1.0)
    ratio = float(run.error_norm[-1] / run.error_norm[0])
    assert ratio == pytest.approx(np.exp(-2.0), rel=5e-3)


def test_halving_the_period_halves_the_distance_to_the_continuous_path(free_scene):
    """A command held for dt is a method of first order."""
    task, scene = rs.IBVS(goal=GOAL), free_scene(SQUARE)
    ends = [
        rs.simulate(scene, task, START, dt=dt, duration=1.0).q_end.values
        for dt in (0.04, 0.02, 0.01)
    ]
    ratio = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2])
    assert ratio == pytest.approx(2.0, abs=0.15)


def test_moving_the_whole_world_changes_neither_features_nor_camera_twist(free_scene):
    away = rs.Pose.at(3, -2, 1, rpy=(0.3, 1.0, -2.0))
    here, scene = rs.IBVS(goal=GOAL), free_scene(SQUARE)
    moved = free_scene(away @ SQUARE)
    a = rs.simulate(scene, here, START, duration=2)
    b = rs.simulate(moved, rs.IBVS(goal=away @ GOAL), away @ START, duration=2)
    np.testing.assert_allclose(a.s, b.s, atol=1e-12)
    np.testing.assert_allclose(a.camera_velocity, b.camera_velocity, atol=1e-11)


def test_moving_the_target_instead_of_the_camera_is_the_same_loop(free_scene):
    """Eye-to-hand is the same relation sdot = L (J_c - J_o) qdot with J_c = 0."""
    camera_moves = rs.simulate(free_scene(SQUARE), rs.IBVS(goal=GOAL), START, duration=2)
    hand = rs.Robot(
        "hand",
        [rs.joints.Link("base"), rs.joints.Link("palm", "base", rs.joints.Joint("floating"))],
    )
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)))
    scene = rs.Scene([hand], [rs.Object("dots", marks=SQUARE, on="hand.palm")], [eye])
    task = rs.IBVS(goal=GOAL.inv())
    target_moves = rs.simulate(scene, task, START.inv(), duration=2)
    # a held twist of the target in its own axes is not a held twist of the camera: first order
    np.testing.assert_allclose(target_moves.s[0], camera_moves.s[0], atol=1e-13)
    np.testing.assert_allclose(target_moves.error_norm, camera_moves.error_norm, rtol=0.03)
    fine = [
        rs.simulate(s, t, q, duration=1, dt=1e-3).s.values[-1]
        for s, t, q in ((scene, task, START.inv()), (free_scene(SQUARE), rs.IBVS(goal=GOAL), START))
    ]
    np.testing.assert_allclose(fine[0], fine[1], atol=2e-4)


def test_a_body_that_carries_camera_and_target_moves_neither_against_the_other(puma_scene):
    """A joint that carries both is no column of the task, and does not move."""
    slide = rs.Robot(
        "slide",
        [rs.joints.Link("base"), rs.joints.Link("deck", "base", rs.joints.Joint("prismatic"))],
    )
    arm = puma_scene.robot().at(rs.Pose.at(), on="slide.deck")
    square = puma_scene.object()
    table = rs.Object("square", marks=square.marks, pose=square.pose, on="slide.deck")
    scene = rs.Scene([slide, arm], [table], puma_scene.cameras)
    goal = {"puma": [0, np.pi / 4, np.pi, 0, np.pi / 4, 0]}
    start = {"puma": [0.02, np.pi / 4, np.pi, 0.02, np.pi / 4, 0], "slide": [0.3]}
    run = rs.simulate(scene, rs.IBVS(goal=goal), start)
    assert outcome(run) == rs.Outcome.CONVERGED
    assert (run.q.sel(coordinate="slide.deck").dropna("time") == 0.3).all()


def test_at_the_goal_nothing_moves(free_scene):
    run = rs.simulate(free_scene(SQUARE), rs.IBVS(goal=GOAL), GOAL)
    assert outcome(run) == rs.Outcome.CONVERGED
    assert float(run.end_time) == 0.0
    assert float(run.path_length) == 0.0


def test_with_k_equal_to_the_joints_both_laws_and_inverses_agree(free_scene):
    """For an invertible L J every least-squares solution is the solution."""
    scene = free_scene(SQUARE[:3])
    runs = [
        rs.simulate(scene, rs.IBVS(goal=GOAL, law=law), START, duration=2)
        for law in ("joint", "camera", rs.laws.CameraLaw(0.01))
    ]
    for run in runs[1:]:
        np.testing.assert_allclose(run.q, runs[0].q, atol=1e-9)


def test_the_path_length_is_the_sum_of_the_steps(puma_scene, puma_goal, puma_starts):
    run = rs.simulate(puma_scene, rs.IBVS(goal=puma_goal), puma_starts[0])
    steps = np.diff(run.camera_pose.dropna("time").values[:, :3, 3], axis=0)
    assert float(run.path_length) == pytest.approx(np.linalg.norm(steps, axis=1).sum(), rel=1e-12)


def test_the_recorded_camera_twist_carries_the_camera_from_pose_to_pose(
    puma_scene, puma_goal, puma_starts
):
    """V over one period is close to the motion, to second order in dt."""
    task, misses = rs.IBVS(goal=puma_goal), []
    for dt in (0.02, 0.01):
        run = rs.simulate(puma_scene, task, puma_starts[0], dt=dt, duration=0.1)
        T = rs.Pose(run.camera_pose.values)
        there = T[0] @ rs.Pose.exp(dt * run.camera_velocity.values[0])
        misses.append(np.abs(there.matrix - T[1].matrix).max())
    assert np.log2(misses[0] / misses[1]) == pytest.approx(2.0, abs=0.1)


def test_wrong_intrinsics_leave_no_error_with_a_shown_goal_and_some_with_a_computed_one(
    puma_scene, puma_goal, puma_starts
):
    """Truth and belief: with a shown goal the loop hides the wrong camera."""
    eye = puma_scene.camera()
    wrong = rs.Camera([[1000, 0, 300], [0, 900, 260], [0, 0, 1]], size=(640, 480))
    belief = puma_scene.replacing(rs.MountedCamera("eye", wrong, eye.on, eye.pose))
    shown = rs.simulate(
        puma_scene, rs.IBVS(goal=puma_goal, belief=belief), puma_starts[0], duration=30
    )
    assert outcome(shown) == rs.Outcome.CONVERGED
    assert float(shown.pixel_error) < 0.05
    goal = rs.GoalPose(rs.Pose.at(0, 0, 0.5))
    computed = rs.simulate(
        puma_scene, rs.IBVS(goal=goal, belief=belief), puma_starts[0], duration=30
    )
    place = rs.Pose(puma_scene.pose("square").matrix).inv() @ rs.Pose(
        puma_scene.pose("eye", computed.q_end.values).matrix
    )
    assert abs(float(place.position[2]) + 0.5) > 0.05  # it stands at the goal of its wrong camera


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_a_wrong_depth_still_converges_near_the_goal(free_scene, scale):
    """Depth scales the translational columns only; IBVS is known to be robust to it."""
    task = rs.IBVS(goal=GOAL, depth="goal", depth_scale=scale)
    run = rs.simulate(free_scene(SQUARE), task, START, duration=60)
    assert outcome(run) == rs.Outcome.CONVERGED


def test_constant_depth_equals_scaled_goal_depth_where_all_depths_are_equal(free_scene):
    scene = free_scene(SQUARE)  # at the goal all marks are 0.6 m away
    a = rs.simulate(scene, rs.IBVS(goal=GOAL, depth=0.9), START, duration=2)
    b = rs.simulate(scene, rs.IBVS(goal=GOAL, depth="goal", depth_scale=1.5), START, duration=2)
    np.testing.assert_allclose(a.s, b.s, atol=1e-13)


def test_noise_has_the_requested_deviation_and_does_not_enter_the_true_pixels(free_scene):
    scene = free_scene(SQUARE, K=[[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    task = rs.IBVS(goal=GOAL, features=rs.features.PixelPoints())
    run = rs.simulate(scene, task, GOAL, sensing=rs.Sensing(noise=0.4), duration=100, seed=3)
    noise = run.s.values - run.pixels.values.reshape(-1, 8)
    assert noise.std() == pytest.approx(0.4, rel=0.03)
    assert abs(noise.mean()) < 0.02


def test_a_users_feature_gives_the_same_run_as_the_built_in_one(free_scene):
    class Mine:
        unit, tolerance = "1", 1e-5

        def measure(self, seen):
            return seen.points.reshape(len(seen.points), -1)

        def interaction(self, seen):
            return rs.features.Points().interaction(seen)

    scene = free_scene(SQUARE)
    a = rs.simulate(scene, rs.IBVS(goal=GOAL, features=Mine()), START, duration=2)
    b = rs.simulate(scene, rs.IBVS(goal=GOAL), START, duration=2)
    np.testing.assert_array_equal(a.q, b.q)
    assert a.attrs["scenario"] == "" and "Mine" in a.attrs["no_scenario"]
