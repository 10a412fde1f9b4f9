"""A believed scene is the true one with the mistakes that were named, and no other."""

import numpy as np
import pytest

import robsim as rs

ROWS = np.array([[0.1, 0.3, 0.02, -1.2], [0.0, 0.0, 0.4, 0.3], [-0.2, 0.1, 0.1, 0.7]])
LENS = rs.Camera([[800, 2, 320], [0, 820, 240], [0, 0, 1]], (640, 480))


def scene(rows=ROWS, convention="standard", joints="RPR"):
    arm = rs.Robot.from_dh(rows, convention, joints, name="arm", links=["a", "b", "c"])
    cup = rs.Object("cup", marks=[[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], pose=rs.Pose.at(1, 0, 1))
    return rs.Scene([arm], [cup], [rs.MountedCamera("eye", LENS, "arm.c", rs.Pose.at(0, 0, 0.1))])


def test_without_a_mistake_it_is_the_truth():
    assert scene().believe() == scene()


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("joints", ["RRR", "RPR", "PPR"])
@pytest.mark.parametrize("row", range(3))
def test_errors_of_a_row_agree_with_the_table(convention, joints, row):
    errors = np.array([0.05, 0.02, -0.03, 0.04])
    wrong = ROWS.copy()
    wrong[row] += errors
    options = {"abc"[row]: dict(zip(("theta", "d", "a", "alpha"), errors, strict=True))}
    truth = scene(ROWS, convention, joints)
    believed = truth.believe(dh=options, convention=convention)
    q = [0.3, 0.2, -0.7]
    for link in "abc":
        np.testing.assert_allclose(
            believed.robot().fk(q, link),
            scene(wrong, convention, joints).robot().fk(q, link),
            atol=1e-15,
        )


def test_intrinsics():
    eye = scene().believe(focal=1.1, center=(3, -2)).camera().camera
    np.testing.assert_allclose(eye.K, [[880, 2, 323], [0, 902, 238], [0, 0, 1]])
    assert eye.size == (640, 480)
    both = scene().believe(focal=(1.1, 0.9), distortion=[0.1, 0, 0, 0]).camera().camera
    np.testing.assert_allclose(np.diag(both.K), [880, 738, 1])
    assert both.distortion == (0.1, 0, 0, 0)


def test_hand_eye_base_and_place_are_errors_at_the_end_of_the_true_pose():
    error = rs.Pose.at(0.01, 0.02, 0.03, rpy=(0.1, 0.2, 0.3))
    believed = scene().believe(hand_eye=error, base=error, place=error)
    assert believed.camera().pose == rs.Pose.at(0, 0, 0.1) @ error
    assert believed.robot().base == error
    assert believed.object().pose == rs.Pose.at(1, 0, 1) @ error


def test_the_target():
    np.testing.assert_allclose(scene().believe(size=1.5).object().marks[1], [0.15, 0, 0])
    other = [[0, 0, 0.1], [0.1, 0, 0], [0, 0.1, 0]]
    np.testing.assert_array_equal(scene().believe(marks=other).object().marks, other)


def test_a_depth_that_is_wrong_mark_by_mark_is_the_uniform_one_where_the_factors_are_equal():
    visp = rs.load_scenario(rs.examples.path("visp_tutorial"))
    goal, options = visp.task.goal, {"duration": 1.0}
    one = rs.simulate(visp.scene, rs.IBVS(goal, depth_scale=1.3), visp.start, **options)
    four = rs.simulate(visp.scene, rs.IBVS(goal, depth_scale=[1.3] * 4), visp.start, **options)
    uneven = rs.simulate(
        visp.scene, rs.IBVS(goal, depth_scale=[1, 1, 1, 1.3]), visp.start, **options
    )
    np.testing.assert_array_equal(one.q.values, four.q.values)
    assert np.abs(one.q.values - uneven.q.values).max() > 1e-3
    assert rs.replay(uneven).identical(uneven)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        ({"focal": 0}, "focal: expected one factor above 0, or two, got 0"),
        ({"focal": [1, 2, 3]}, "focal: expected one factor above 0, or two"),
        ({"center": 3}, "center (pixels): expected shape"),
        ({"hand_eye": 3}, "hand_eye (an error)"),
        ({"dh": {"d": {"a": 1}}}, "no link 'd' in 'arm'; links: base, a, b, c"),
        ({"dh": {"a": {"b": 1}}}, "dh of 'a': expected errors of theta, d, a, alpha"),
        ({"dh": {"a": {"d": "1 cm"}}}, "dh of a.d: expected a number, got '1 cm'"),
        ({"dh": [1]}, "dh: expected {link: {'a': metres, ...}}, got [1]"),
        ({"dh": {"a": {"d": 1}}, "convention": "craig"}, "convention must be 'standard' or"),
        ({"marks": [[0, 0, 0]]}, "marks of 'cup': expected shape (3, 3), got (1, 3)"),
        ({"size": -1}, "size (a factor) must be a positive number, got -1"),
        ({"camera": "eve", "focal": 2}, "no camera 'eve' in the scene; did you mean 'eye'?"),
        ({"camera": "eve"}, "no camera 'eve' in the scene; did you mean 'eye'?"),
        ({"robot": "am"}, "no robot 'am' in the scene; did you mean 'arm'?"),
        ({"target": "cap"}, "no object 'cap' in the scene; did you mean 'cup'?"),
        ({"convention": "craig"}, "convention must be 'standard' or 'modified', got 'craig'"),
        ({"dh": []}, "dh: expected {link: {'a': metres, ...}}, got []"),
        ({"focal": True}, "focal (a factor): expected a number, got True"),
        ({"focal": ("a", "b")}, "focal (a factor): expected a number, got ('a', 'b')"),
        ({"focal": 1e308}, "K: inf"),
        ({"center": 0}, "center (pixels): expected shape"),
        ({"size": True}, "size (a factor): expected a number, got True"),
    ],
)
def test_a_mistake_in_a_mistake_is_refused(made, words):
    with pytest.raises(rs.errors.InputError) as error:
        scene().believe(**made)
    assert words in str(error.value)


def test_the_depth_factors_must_be_one_for_each_mark():
    visp = rs.load_scenario(rs.examples.path("visp_tutorial"))
    with pytest.raises(rs.errors.InputError, match="3 factors for the 4 marks of"):
        rs.simulate(visp.scene, rs.IBVS(visp.task.goal, depth_scale=[1, 2, 3]))
    with pytest.raises(rs.errors.InputError, match="factor above zero, or one for each mark"):
        rs.IBVS(depth_scale=[1, 0])


def test_the_run_names_the_wrong_beliefs():
    visp = rs.load_scenario(rs.examples.path("visp_tutorial"))
    for mistake, said in (({}, "the truth"), ({"focal": 2.0}, "differs from the truth: camera")):
        task = rs.IBVS(visp.task.goal, belief=visp.scene.believe(**mistake))
        run = rs.simulate(visp.scene, task, visp.start, duration=0.2)
        assert run.attrs["belief"] == said


VISP = rs.load_scenario(rs.examples.path("visp_tutorial"))


def test_a_mount_that_is_turned_turns_the_motion_by_as_much():
    """A flying body that believes its camera turned by 0.3 rad flies the command, turned back."""
    turn = rs.Pose.at(rpy=(0, 0, 0.3))
    start = rs.Pose(VISP.scene.pose("camera", VISP.start).matrix)
    options = {"duration": 0.04, "dt": 0.04}
    goal = rs.tasks.TaughtGoal(VISP.task.goal.q)
    plain = rs.simulate(VISP.scene, rs.IBVS(goal), start.q, **options)
    askew = VISP.scene.believe(hand_eye=turn)
    wrong = rs.simulate(VISP.scene, rs.IBVS(goal, belief=askew), start.q, **options)
    V, meant = wrong.camera_velocity.values[0], plain.camera_velocity.values[0]
    for part in (slice(0, 3), slice(3, 6)):
        np.testing.assert_allclose(V[part], turn.rotation @ meant[part], atol=1e-12)


@pytest.mark.parametrize("size", [0.8, 1.25])
def test_a_model_of_the_wrong_size_puts_a_computed_goal_at_a_distance_over_its_factor(size):
    """k X / Z* = X / Z: believed k times as large, the square is approached to Z* / k."""
    task = rs.IBVS(rs.GoalPose(rs.Pose.at(0, 0, 0.75)), belief=VISP.scene.believe(size=size))
    start = rs.Pose.at(0.05, -0.05, -1.0)
    for scheme in (task, rs.PBVS(task.goal, belief=task.belief)):
        run = rs.simulate(VISP.scene, scheme, start, duration=40, record="summary")
        assert run.outcome == rs.Outcome.CONVERGED
        np.testing.assert_allclose(run.q_end.values[:3], [0, 0, -0.75 / size], atol=2e-4)


def test_wrong_links_give_the_command_of_the_wrong_jacobian():
    """qdot = -gain (L J)^+ e with J of the believed arm at the same joints, in plain NumPy."""
    puma = rs.load_scenario(rs.examples.path("wrong_calibration"))
    scene, q = puma.scene, puma.start
    believed = scene.believe(dh={"forearm": {"a": 0.01, "alpha": 0.02}, "wrist_roll": {"d": 0.02}})
    goal = scene.home + 0.05
    run = rs.simulate(
        scene, rs.IBVS(goal, belief=believed, depth=0.5), q, dt=0.04, duration=0.04, hold=True
    )
    K, eye = scene.camera().camera.K, scene.camera()
    x, x_goal = ((scene.view(at).pixels - K[:2, 2]) / np.diag(K)[:2] for at in (q, goal))
    L = np.concatenate(
        [
            [[-2, 0, 2 * u, u * v, -1 - u * u, v], [0, -2, 2 * v, 1 + v * v, -u * v, -u]]
            for u, v in x
        ]
    )
    T, J = believed.pose("camera", q), believed.robot().jacobian(q, "flange")
    lever = T.position - believed.pose("puma560.flange", q).position
    cross = np.cross(J[3:].T, lever).T
    R = T.rotation.T
    J_c = np.concatenate([R @ (J[:3] + cross), R @ J[3:]])
    expected = -np.linalg.pinv(L @ J_c) @ (x - x_goal).ravel()
    assert eye.on == "puma560.flange"
    np.testing.assert_allclose(run.qd.values[0], expected, atol=1e-9)
