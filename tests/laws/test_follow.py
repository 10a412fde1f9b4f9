"""Tasks that follow trajectories: on them at every sample, back to them, and how runs end."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.servo.single_step import SingleStepController
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid

DT = 0.04
START = np.array([0.2, 1.1, -3.0, 0.3, -0.4, 0.2])


@pytest.fixture(scope="module")
def arm():
    return rs.Scene([rs.robots.puma560()])


def followed(scene, task, q0=START, **told):
    return rs.simulate(scene, task, q0, **{"dt": DT, **told})


def lived(run):
    """The moments up to the end of a single run."""
    return run.isel(time=slice(0, round(float(run.end_time) / run.attrs["dt"]) + 1))


def outcome(run):
    return rs.Outcome(int(run.outcome)).name


# joints


def any_trajectory(rng, start):
    end = start + rng.uniform(-0.2, 0.2, len(start))
    limits = {"speed": rng.uniform(0.2, 1, len(start)), "acceleration": rng.uniform(0.5, 2)}
    kind = rng.integers(3)
    if kind == 0:
        return Quintic(start, end, rng.uniform(0.3, 2))
    if kind == 1:
        return Trapezoid(start, end, **limits)
    return Blends([start, end, start + rng.uniform(-0.2, 0.2, len(start))], **limits)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1), st.sampled_from([None, 2.0]))
def test_joints_are_on_the_trajectory_at_every_sample(seed, gain):
    scene, rng = rs.Scene([rs.robots.puma560()]), np.random.default_rng(seed)
    r = any_trajectory(rng, START)
    run = lived(followed(scene, rs.FollowJoints(trajectory=r, gain=gain)))
    np.testing.assert_allclose(run.q, r.at(run.time.values), rtol=0, atol=1e-12)
    assert outcome(run) == "CONVERGED"
    assert r.duration - 1e-9 <= float(run.end_time) < r.duration + DT
    np.testing.assert_array_equal(run.s_goal, r.at(r.duration))
    np.testing.assert_array_equal(run.s, run.q)


def test_each_run_is_planned_from_where_it_starts(arm):
    starts = START + np.random.default_rng(0).uniform(-0.2, 0.2, (5, 6))
    to = {"shoulder": 0.5, "puma560.wrist_roll": -0.3}
    limits = {"speed": [0.5, 1.0], "acceleration": [1.0, 3.0]}
    for told in ({"duration": 1.5}, limits):
        run = followed(arm, rs.FollowJoints(to, **told), starts)
        for b in range(5):
            one = lived(run.isel(run=b))
            ends = starts[b, [0, 3]], [0.5, -0.3]
            r = Quintic(*ends, 1.5) if told is not limits else Trapezoid(*ends, **limits)
            np.testing.assert_allclose(one.q[:, [0, 3]], r.at(one.time.values), rtol=0, atol=1e-12)
            assert r.duration - 1e-9 <= float(one.end_time) < r.duration + DT
            assert (one.q[:, [1, 2, 4, 5]] == starts[b, [1, 2, 4, 5]]).all()


def test_an_array_is_in_the_order_of_the_joints_that_are_named(arm):
    task = rs.FollowJoints([-0.1, 0.3], joints=["wrist_roll", "shoulder"], duration=1.0)
    run = followed(arm, task)
    np.testing.assert_allclose(run.q_end[[3, 0]], [-0.1, 0.3], rtol=0, atol=1e-12)
    assert run.feature_unit.values.tolist() == ["rad", "rad"]
    r = Trapezoid(START[[3, 0]], [-0.1, 0.3], speed=[1.0, 0.1], acceleration=1.0)
    run = lived(followed(arm, rs.FollowJoints(trajectory=r, joints=["wrist_roll", "shoulder"])))
    np.testing.assert_allclose(run.q[:, [3, 0]], r.at(run.time.values), rtol=0, atol=1e-12)


def test_a_start_beside_the_trajectory_comes_to_it(arm):
    r = Quintic(START, START + 0.1, 2.0)
    beside = START + 0.01
    for gain, most in ((None, 1e-12), (3.0, 1.1 * 0.01 * np.exp(-3.0))):
        run = followed(arm, rs.FollowJoints(trajectory=r, gain=gain), beside)
        away = np.abs(run.q.values - r.at(run.time.values)).max(axis=1)
        assert away[0] == pytest.approx(0.01) and away[25] < most
        assert outcome(run) == "CONVERGED"


@pytest.mark.parametrize("gain", [None, 2.5])
def test_joints_that_lag_come_to_the_end_as_well(arm, gain):
    task = rs.FollowJoints({"shoulder": 0.8}, duration=2.0, gain=gain)
    run = followed(arm, task, actuation=rs.Actuation(lag=0.1), duration=20)
    assert outcome(run) == "CONVERGED" and float(run.end_time) > 2.0
    assert abs(float(run.q_end[0]) - 0.8) < 1e-6
    after = lived(run).q.values[51:, 0] - 0.8
    turns = np.count_nonzero(np.diff(np.sign(after)))
    assert turns <= 1 if gain else turns > 5  # 1/(4 lag) does not ring
    assert np.abs(after).max() < (0.03 if gain else 0.002)


def test_joints_at_their_limits_of_acceleration_come_to_the_end(arm):
    task = rs.FollowJoints({"shoulder": 0.8}, speed=0.5, acceleration=1.0, gain=2.5)
    limits = rs.Actuation(velocity=0.5, acceleration=1.0, lag=0.05)
    run = followed(arm, task, actuation=limits, duration=20)
    assert outcome(run) == "CONVERGED"


def test_a_run_is_not_judged_before_its_trajectory_is_over(arm):
    """Away and back again: it starts at its end, and goes far from it."""
    points = [START[:1], START[:1] + 1.0, START[:1]]
    r = Blends(points, speed=0.8, acceleration=2.0)
    run = followed(arm, rs.FollowJoints(trajectory=r, joints="shoulder"))
    assert outcome(run) == "CONVERGED" and float(run.end_time) >= r.duration
    assert np.nanmax(np.abs(run.error)) > 0.8
    slow = Quintic(START[:1], START[:1] + 1e-7, 3.0)  # below the tolerance, and next to no motion
    run = followed(arm, rs.FollowJoints(trajectory=slow, joints="shoulder"))
    assert outcome(run) == "CONVERGED" and float(run.end_time) == pytest.approx(3.0)


def test_a_joint_that_passes_its_limit_on_the_way_ends_the_run(arm):
    high = arm.limits[0, 1]
    r = Blends([[START[0]], [high + 0.5], [START[0]]], speed=1.0, acceleration=2.0)
    run = followed(arm, rs.FollowJoints(trajectory=r, joints="shoulder"))
    assert outcome(run) == "JOINT_LIMIT"


def test_time_may_be_over_before_the_trajectory(arm):
    run = followed(arm, rs.FollowJoints({"shoulder": 0.5}, duration=5.0), duration=1.0)
    assert outcome(run) == "TIME_LIMIT"
    held = followed(arm, rs.FollowJoints({"shoulder": 0.5}, duration=1.0), duration=2.0, hold=True)
    assert outcome(held) == "CONVERGED" and float(held.end_time) == 2.0


def test_a_trajectory_of_the_users_own(arm):
    class Wave:
        duration = 2.0

        def at(self, t):
            return START[:2] + 0.1 * np.sin(np.pi * np.minimum(t, 2.0))

    names = ["shoulder", "upper_arm"]
    run = lived(followed(arm, rs.FollowJoints(trajectory=Wave(), joints=names)))
    wanted = np.array([Wave().at(t) for t in run.time.values])
    np.testing.assert_allclose(run.q[:, :2], wanted, rtol=0, atol=1e-12)


def test_the_motion_of_the_tip_is_recorded(arm):
    run = lived(followed(arm, rs.FollowJoints({"shoulder": 0.6, "forearm": -2.5}, duration=1.0)))
    assert "camera_pose" not in run and run.frame_pose.attrs["frame"] == "puma560.flange"
    T = rs.Pose(run.frame_pose.values)
    np.testing.assert_allclose(
        T.matrix, arm.pose("puma560.flange", run.q.values).matrix, atol=1e-14
    )
    V, k = run.frame_velocity.values, 12
    rates = arm.robots[0].jacobian(run.q.values[k]) @ run.qd.values[k]
    R = T.rotation[k]
    np.testing.assert_allclose(V[k], np.concatenate([R.T @ rates[:3], R.T @ rates[3:]]), atol=1e-13)
    steps = np.linalg.norm(np.diff(T.position, axis=0), axis=1)
    assert float(run.path_length) == pytest.approx(steps.sum(), rel=1e-12)
    assert run.sizes["mark"] == 0 and np.isnan(run.pixel_error)


def test_a_prismatic_joint_goes_in_metres():
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("lift", "base", rs.joints.Joint("prismatic", limits=(0.0, 0.5))),
    ]
    links += [rs.joints.Link("turn", "lift", rs.joints.Joint("revolute"))]
    scene = rs.Scene([rs.Robot("pole", links)])
    run = rs.simulate(scene, rs.FollowJoints({"lift": 0.3, "turn": 1.0}, duration=1.0))
    assert run.feature_unit.values.tolist() == ["m", "rad"]
    np.testing.assert_allclose(run.q_end, [0.3, 1.0], rtol=0, atol=1e-12)


# paths


def reached(scene, q, offset=None):
    """The pose of the flange at q, moved."""
    T = rs.Pose(scene.pose("puma560.flange", q).matrix)
    return T if offset is None else rs.Pose.at(*offset[:3]) @ T @ rs.Pose.at(rotvec=offset[3:])


OFFSET = np.array([0.05, -0.1, 0.08, 0.3, -0.2, 0.4])


def off_the_path(run, path):
    T = run.frame_pose.values
    return np.abs(T - path.at(run.time.values)).max()


def test_the_distance_from_the_path_is_of_the_second_order_in_the_period(arm):
    path = Straight(reached(arm, START), reached(arm, START, OFFSET), 2.0)
    task = rs.FollowPath(path=path)
    off = []
    for dt in (0.08, 0.04, 0.02, 0.01):
        run = lived(followed(arm, task, dt=dt))
        assert outcome(run) == "CONVERGED" and float(run.end_time) == pytest.approx(2.0)
        off.append(off_the_path(run, path))
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 4.0, rtol=0.05)
    assert off[1] < 1e-3  # metres and entries of rotations, at the usual 40 ms


def test_a_base_that_moves_on_its_own_does_not_pull_the_frame_off_its_path():
    """Second order in the period as well: motion that the frame has anyway is not commanded."""
    belt = rs.robots.conveyor()
    arm = rs.robots.puma560().at(rs.Pose.at(0, 0, 0.5), on="conveyor.belt")
    scene = rs.Scene([belt, arm], motions=[rs.Motion("conveyor", [0.05])])
    goal = rs.Pose(scene.pose("puma560.flange").matrix) @ rs.Pose.at(0.05, 0, -0.1)
    task, away = rs.FollowPath(goal, frame="puma560.flange", duration=1.0), []
    for dt in (0.04, 0.02):
        run = rs.simulate(scene, task, dt=dt, duration=2.0, hold=True)
        away.append(np.abs(run.frame_pose.values[-1] - goal.matrix).max())
    assert away[0] < 1e-5 and away[0] / away[1] == pytest.approx(4.0, abs=0.1)


def test_each_path_is_planned_from_where_its_run_starts(arm):
    starts = START + np.random.default_rng(1).uniform(-0.1, 0.1, (4, 6))
    goal = reached(arm, START, OFFSET)
    limits = {"speed": 0.1, "acceleration": 0.3, "turn": 0.4, "turn_acceleration": 1.0}
    for told in ({"duration": 1.5}, limits):
        run = followed(arm, rs.FollowPath(goal, **told), starts)
        for b in range(4):
            one = lived(run.isel(run=b))
            path = Straight(reached(arm, starts[b]), goal, **told)
            assert outcome(one) == "CONVERGED" and off_the_path(one, path) < 2e-3
            assert path.duration - 1e-9 <= float(one.end_time) < path.duration + 2 * DT + 1e-9
            T = rs.Pose(arm.pose("puma560.flange", run.q_end[b].values).matrix)
            assert np.abs((goal.inv() @ T).matrix - np.eye(4)).max() < 2e-6


def test_a_position_alone_leaves_the_orientation_free(arm):
    goal = reached(arm, START, OFFSET).position
    for told in ({"duration": 1.0}, {"speed": 0.2, "acceleration": 0.5}):
        task = rs.FollowPath(goal, mask="position", **told)
        run = lived(followed(arm, task))
        assert outcome(run) == "CONVERGED" and run.feature_unit.values.tolist() == ["m"] * 3
        p = run.frame_pose.values[:, :3, 3]
        np.testing.assert_allclose(p[-1], goal, rtol=0, atol=1e-6)
        way = goal - p[0]
        off = np.cross(p - p[0], way / np.linalg.norm(way))
        assert np.abs(off).max() < 1e-3


def test_a_path_of_several_parts(arm):
    poses = [reached(arm, START), reached(arm, START, OFFSET), reached(arm, START, -0.5 * OFFSET)]
    path = Path([Straight(poses[0], poses[1], 1.0), Straight(poses[1], poses[2], 1.0)])
    run = lived(followed(arm, rs.FollowPath(path=path), dt=0.02))
    assert outcome(run) == "CONVERGED" and off_the_path(run, path) < 2e-3


@pytest.mark.parametrize("gain", [None, 2.5])
def test_a_path_with_joints_that_lag(arm, gain):
    task = rs.FollowPath(reached(arm, START, OFFSET), duration=2.0, gain=gain)
    run = followed(arm, task, actuation=rs.Actuation(lag=0.1), duration=20)
    assert outcome(run) == "CONVERGED" and float(run.end_time) > 2.0


def test_with_a_gain_the_lag_behind_the_trajectory_decays_with_it(arm):
    path = Straight(reached(arm, START), reached(arm, START, OFFSET), 3.0)
    run = followed(arm, rs.FollowPath(path=path, gain=2.0), START + 0.02, dt=0.01)
    T, wanted = run.frame_pose.values, path.at(run.time.values)
    away = np.linalg.norm(T[:, :3, 3] - wanted[:, :3, 3], axis=1)
    assert away[100] / away[0] == pytest.approx((1 - 2.0 * 0.01) ** 100, rel=0.05)


def test_the_error_is_position_and_turn_from_the_end(arm):
    goal = reached(arm, START, OFFSET)
    run = lived(followed(arm, rs.FollowPath(goal, duration=1.0)))
    T = rs.Pose(run.frame_pose.values[0])
    np.testing.assert_allclose(run.error[0, :3], T.position - goal.position, atol=1e-15)
    turn = rs.Pose(np.block([[T.rotation @ goal.rotation.T, np.zeros((3, 1))], [0, 0, 0, 1]]))
    np.testing.assert_allclose(run.error[0, 3:], turn.rotvec, atol=1e-14)
    assert run.feature_unit.values.tolist() == ["m"] * 3 + ["rad"] * 3
    assert np.abs(run.error[-1]).max() < 1e-6


def test_the_reach_of_a_path_is_the_derivative_of_its_features(arm):
    task = rs.FollowPath(reached(arm, START, 3 * OFFSET), duration=1.0)
    controller, tree = task.bind(arm), arm.robots[0]
    alone = SingleStepController(controller, DT)

    def s(q):
        return alone.decide(alone.begin(1), 0, q[:, None], {}, {}).command

    task_jacobian = s(START).task_jacobian[..., 0]
    for j in range(6):
        step = 1e-6 * np.eye(6)[j]
        ahead, behind = (s(tree.integrate(START, sign * step, 1.0)).s[:, 0] for sign in (1, -1))
        np.testing.assert_allclose((ahead - behind) / 2e-6, task_jacobian[:, j], atol=2e-9)


def test_a_goal_beyond_reach_ends_as_a_singularity():
    scene = rs.Scene([rs.robots.planar_2r()])
    tip = f"planar_2r.{scene.robots[0].tip}"
    straight = scene.pose(tip, [0.0, 0.0]).position
    task = rs.FollowPath(straight + np.array([0.1, 0, 0]), mask="position", duration=1.0)
    run = rs.simulate(scene, task, [0.0, 0.0])
    assert outcome(run) == "SINGULAR" and float(run.end_time) >= 1.0
    inside = rs.FollowPath(0.8 * straight, mask="position", duration=1.0)
    assert outcome(rs.simulate(scene, inside, [0.3, 0.4])) == "CONVERGED"


def test_a_redundant_arm_keeps_near_a_posture():
    scene = rs.Scene([rs.robots.panda()])
    home = scene.home
    goal = rs.Pose.at(0.05, 0.1, -0.05) @ rs.Pose(scene.pose(f"panda.{scene.robots[0].tip}").matrix)
    ends = {}
    for name, secondary in (("free", None), ("kept", rs.laws.Posture(home, gain=2.0))):
        task = rs.FollowPath(goal, duration=2.0, secondary=secondary)
        run = rs.simulate(scene, task)
        assert outcome(run) == "CONVERGED"
        ends[name] = np.linalg.norm(run.q_end - home)
    assert ends["kept"] <= ends["free"] + 1e-9


def test_a_wheeled_base_and_its_arm_share_the_way():
    scene = rs.Scene([rs.robots.mobile_arm()])
    robot = scene.robots[0]
    tip = f"{robot.name}.{robot.tip}"
    goal = rs.Pose.at(0.2, 0.05, 0.02) @ rs.Pose(scene.pose(tip).matrix)
    run = rs.simulate(scene, rs.FollowPath(goal.position, mask="position", duration=3.0))
    assert outcome(run) == "CONVERGED"
    assert np.ptp(run.q.dropna("time").values, axis=0).astype(bool).sum() > 3


# together with servoing


def both(camera):
    """A pan-tilt head that watches a square, and an arm."""
    head, arm = rs.robots.pan_tilt(), rs.robots.puma560().at(rs.Pose.at(2, 0, 0))
    mount = f"pan_tilt.{head.tip}"
    T = rs.Scene([head]).pose(mount)
    marks = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    square = rs.Object("square", marks=marks, pose=rs.Pose(T.matrix) @ rs.Pose.at(0, 0, 1))
    return rs.Scene([head, arm], [square], [rs.MountedCamera("eye", camera, mount)])


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
@pytest.mark.parametrize("first", [0, 1])
def test_an_arm_follows_while_a_head_servos(camera, first):
    scene = both(camera)
    q0 = scene.home + np.array([0.05, -0.04] + [0.0] * 6)
    watch = rs.IBVS(joints="pan_tilt", gain=2.0)
    goal = scene.home[2:] + 0.1
    arrive = rs.FollowJoints(goal, joints="puma560", duration=3.0)
    tasks = [watch, arrive] if first == 0 else [arrive, watch]
    run = rs.simulate(scene, rs.Parallel(tasks), q0, duration=20)
    alone = rs.simulate(scene, watch, q0, duration=20)
    assert outcome(run) == outcome(alone) == "CONVERGED"
    count = round(float(alone.end_time) / DT) + 1
    np.testing.assert_array_equal(run.q.values[:count, :2], alone.q.values[:count, :2])
    np.testing.assert_array_equal(run.camera_pose.values[:count], alone.camera_pose.values[:count])
    r = Quintic(scene.home[2:], goal, 3.0)
    one = lived(run)
    np.testing.assert_allclose(one.q[:, 2:], r.at(one.time.values), rtol=0, atol=1e-12)
    assert float(run.end_time) == pytest.approx(max(3.0, float(alone.end_time)))


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
def test_from_a_trajectory_on_to_servoing(puma_scene, puma_goal):
    """A switch: first near the goal by a trajectory, then by the image."""
    near = rs.FollowJoints(puma_goal, duration=1.0)
    servo = rs.IBVS(goal=puma_goal)
    task = rs.Switch(near, servo, rs.tasks.ErrorBelow(0.01))
    run = rs.simulate(puma_scene, task, puma_goal + 0.02, duration=30)
    assert outcome(run) == "CONVERGED" and float(run.end_time) > 1.0
    border = rs.Switch(
        near, servo, rs.tasks.NearBorder(5, (640, 480))
    )  # what sees nothing sees none
    assert outcome(rs.simulate(puma_scene, border, puma_goal + 0.02, duration=30)) == "CONVERGED"


# analyses and figures


def test_runs_without_a_camera_are_compared_and_drawn(arm):
    tasks = {
        "quick": rs.FollowJoints({"shoulder": 0.5}, duration=1.0),
        "slow": rs.FollowJoints({"shoulder": 0.5}, duration=2.0),
    }
    found = rs.compare(arm, tasks, START)
    assert found.data.time.values.tolist() == [1.0, 2.0]
    ratio = found.data.peak_turn_rate.values
    assert ratio[0] / ratio[1] == pytest.approx(2.0, rel=0.01)
    assert np.isnan(found.data.image_detour).all() and np.isnan(found.data.retreat).all()
    run = found.runs["quick"]
    assert rs.plot.velocity(run).axes[0].get_ylabel().startswith("v of puma560.flange")
    assert len(rs.plot.run(run, arm).axes) == 4
    with pytest.raises(rs.errors.InputError, match="this run uses no camera"):
        rs.plot.image(run)


def test_analyses_of_servoing_report_that_there_is_none(arm):
    task = rs.FollowJoints({"shoulder": 0.5}, duration=1.0)
    run = followed(arm, task)
    for look in (rs.explain, rs.diagnose):
        with pytest.raises(rs.errors.InputError, match="this run uses no camera"):
            look(run)
    for moving in (task, rs.FollowPath(reached(arm, START), duration=1.0)):
        with pytest.raises(rs.errors.InputError, match="follows time"):
            rs.equilibria(arm, moving)


# refusals

ONE = Quintic([0.0], [0.1], 1.0)


class Endless:
    duration = np.inf

    def at(self, t):
        return [0.0]


@pytest.mark.parametrize(
    "told,message",
    [
        ({}, "give one of to="),
        ({"to": [0.0], "trajectory": ONE}, "give one of to="),
        ({"to": [0.0]}, "give either duration, or speed and acceleration; got None"),
        ({"to": [0.0], "speed": 1.0}, "give either duration, .* got speed"),
        ({"to": [0.0], "speed": 1.0, "acceleration": 1.0, "duration": 1.0}, "give either duration"),
        ({"to": [0.0], "duration": -1.0}, "FollowJoints.duration must be a positive number"),
        ({"to": [0.0], "speed": 0.0, "acceleration": 1.0}, "speed must be a positive number"),
        ({"to": [np.nan], "duration": 1.0}, "to: nan at index"),
        ({"to": [[0.0]], "duration": 1.0}, r"to: expected \{joint: value\} or shape \(n,\)"),
        ({"to": {"shoulder": "far"}, "duration": 1.0}, r"to\['shoulder'\]: expected a number"),
        ({"to": {"shoulder": [1, 2]}, "duration": 1.0}, r"to\['shoulder'\]: expected a number"),
        ({"to": {}, "duration": 1.0}, "expected the names of joints"),
        ({"to": {1: 0.0}, "duration": 1.0}, "expected the names of joints"),
        ({"to": {"shoulder": 0.0}, "joints": "forearm", "duration": 1.0}, "leave joints out"),
        ({"trajectory": ONE, "duration": 1.0}, "a trajectory has its own times"),
        ({"trajectory": 3}, r"trajectory: expected an object with duration and at\(t\), got 3"),
        ({"trajectory": Quintic}, "expected a trajectory, not the class, got <class"),
        ({"trajectory": Endless()}, r"trajectory.duration \(seconds\): inf"),
        ({"to": [0.0], "duration": 1.0, "gain": 0.0}, "gain"),
        ({"to": [0.0], "duration": 1.0, "tolerance": -1.0}, "tolerance must be a positive"),
        ({"to": [0.0], "duration": 1.0, "joints": 5}, "joints must be a text, of"),
    ],
)
def test_bad_tasks_for_joints_are_one_clear_error(told, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.FollowJoints(**told)


@pytest.mark.parametrize(
    "task,message",
    [
        (rs.FollowJoints({"sholder": 0.0}, duration=1.0), "no joint 'sholder' .* did you mean 'sh"),
        (rs.FollowJoints({"shoulder": 9.0}, duration=1.0), "'shoulder' is to go to 9 rad, outside"),
        (rs.FollowJoints([0.0, 0.0], duration=1.0), "to: expected 6 axes, for shoulder, upper_arm"),
        (rs.FollowJoints(trajectory=ONE), "trajectory: expected 6 axes"),
        (rs.FollowJoints([0.0], joints="elbow", duration=1.0), "joints: no joint 'elbow'"),
        (
            rs.FollowJoints({"shoulder": 0.0, "puma560.shoulder": 1.0}, duration=1.0),
            "to: 'shoulder' is named twice",
        ),
        (
            rs.FollowJoints([0.0, 0.0], joints=["shoulder", "puma560.shoulder"], duration=1.0),
            "'shoulder' is named twice",
        ),
        (
            rs.FollowJoints({"shoulder": 0.0}, speed=[1, 2], acceleration=1.0),
            "speed: 2 numbers for 1 axes",
        ),
    ],
)
def test_joints_that_the_scene_does_not_have_are_one_clear_error(arm, task, message):
    with pytest.raises(rs.errors.InputError, match=message):
        followed(arm, task)


def test_a_joint_of_two_robots_needs_the_name_of_one():
    arms = [rs.robots.puma560(), rs.robots.puma560().named("other").at(rs.Pose.at(2, 0, 0))]
    scene = rs.Scene(arms)
    with pytest.raises(
        rs.errors.InputError, match=r"is ambiguous: puma560\.shoulder, other\.shoulder"
    ):
        rs.simulate(scene, rs.FollowJoints({"shoulder": 0.1}, duration=1.0))
    run = rs.simulate(scene, rs.FollowJoints({"other.shoulder": 0.1}, duration=1.0))
    assert (
        abs(float(run.q_end[6]) - 0.1) < 1e-12 and run.frame_pose.attrs["frame"] == "other.flange"
    )
    with pytest.raises(
        rs.errors.InputError, match=r"frame: give the frame to move; tips: puma560.fl"
    ):
        rs.simulate(scene, rs.FollowPath(np.eye(4), duration=1.0))


def test_joints_without_their_own_coordinate_or_that_move_alone_cannot_be_named():
    base = rs.Scene([rs.robots.unicycle()])
    with pytest.raises(rs.errors.InputError, match="with a coordinate and a velocity of its own"):
        rs.simulate(base, rs.FollowJoints([0.0, 0.0], duration=1.0))
    belt = rs.Scene([rs.robots.turntable()], motions=[rs.Motion("turntable", [0.1])])
    name = belt.coordinate_names[0]
    with pytest.raises(rs.errors.InputError, match="moves on its own"):
        rs.simulate(belt, rs.FollowJoints({name: 0.1}, duration=1.0))
    with pytest.raises(rs.errors.InputError, match="no joint that a task can command moves"):
        rs.simulate(belt, rs.FollowPath(np.eye(4), duration=1.0))


HERE = np.eye(4)
PACE = {"speed": 1.0, "acceleration": 1.0}


@pytest.mark.parametrize(
    "told,message",
    [
        ({}, "give either to=a pose"),
        ({"to": HERE, "path": Straight(HERE, HERE, 1.0)}, "give either to=a pose"),
        ({"to": HERE}, "give either duration, or speed"),
        ({"to": HERE, "duration": 0.0}, "FollowPath.duration must be a positive number"),
        ({"to": HERE, **PACE}, "expected speed, acceleration, turn and turn_acceleration; got"),
        ({"to": HERE, "turn": 1.0, "turn_acceleration": 1.0}, "expected speed, acceleration"),
        (
            {"to": [0, 0, 1], "mask": "position", **PACE, "turn": 1, "turn_acceleration": 1},
            "expected speed, acceleration alone",
        ),
        ({"to": [0, 0, 1], "duration": 1.0}, 'a position alone is for mask="position"'),
        ({"to": [[0, 0, 1]], "mask": "position", "duration": 1.0}, "expected one position"),
        ({"to": "there", "duration": 1.0}, r"to \(a pose, or a position\): expected"),
        ({"to": np.stack([HERE] * 2), "duration": 1.0}, "expected one pose, got a batch"),
        ({"to": 2 * HERE, "duration": 1.0}, "to: not a rotation"),
        ({"to": HERE, "duration": 1.0, "mask": "turn"}, "no mask 'turn'; masks: pose, position"),
        ({"to": HERE, "duration": 1.0, "frame": 3}, "frame must be a text, of"),
        (
            {"to": HERE, "duration": 1.0, "inverse": "transpose"},
            "no inverse 'transpose'; inverses: pseudo",
        ),
        ({"to": HERE, "duration": 1.0, "inverse": "exact"}, "no inverse 'exact'"),
        ({"to": HERE, "duration": 1.0, "gain": -2}, "gain"),
        ({"path": Straight(HERE, HERE, 1.0), "speed": 1.0}, "a path has its own times"),
        ({"path": [HERE]}, r"path: expected an object with duration and at\(t\)"),
    ],
)
def test_bad_tasks_for_paths_are_one_clear_error(told, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.FollowPath(**told)


def test_a_frame_that_does_not_exist_is_one_clear_error(arm):
    task = rs.FollowPath(HERE, frame="puma560.flang", duration=1.0)
    with pytest.raises(rs.errors.FrameError, match=r"did you mean 'puma560\.flange'"):
        followed(arm, task)
    with pytest.raises(
        rs.errors.InputError, match="no joint that a task can command moves 'world'"
    ):
        followed(arm, rs.FollowPath(HERE, frame="world", duration=1.0))
