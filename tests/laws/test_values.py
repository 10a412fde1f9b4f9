"""Values compare, hash, copy and pickle by their content, and accept valid content only."""

import copy
import pickle

import numpy as np
import pytest

import robsim as rs

POSE = rs.Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3), frames=("world", "cup"))
BATCH = rs.Pose(np.tile(np.eye(4), (2, 1, 1)))


def values():
    rhino = rs.robots.rhino_xr4()
    cube = rs.Object("cube", rs.Block(1, 1, 1), pose=POSE)
    lens = rs.Camera(np.eye(3), (4, 3), body=rs.CameraBody(1, 1, 1), distortion=(0.1, 0, 0, 0))
    eye = rs.MountedCamera("eye", lens, on="rhino_xr4.tool")
    return [POSE, rhino, cube, lens, eye, rs.Scene([rhino], [cube], [eye])]


@pytest.mark.parametrize("value", values(), ids=lambda v: type(v).__name__)
@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))]
)
def test_a_copy_is_equal_and_has_the_same_hash(value, again):
    other = again(value)
    assert other == value
    assert hash(other) == hash(value)


@pytest.mark.parametrize("value", values(), ids=lambda v: type(v).__name__)
def test_nothing_equals_something_else(value):
    assert value != 1
    assert [other == value for other in values()].count(True) == 1


def test_a_robot_with_another_home_is_another_robot():
    rhino = rs.robots.rhino_xr4()
    assert rhino.named("other") != rhino
    assert rs.Robot(rhino.name, rhino.links, rhino.home + 1e-9) != rhino


def test_signed_zeros_are_equal_and_have_equal_hashes():
    a, b = rs.Pose.at(0.0), rs.Pose.at(-0.0)
    assert a == b and hash(a) == hash(b)
    skew = [rs.Camera([[1, zero, 0], [0, 1, 0], [0, 0, 1]]) for zero in (0.0, -0.0)]
    assert skew[0] == skew[1] and hash(skew[0]) == hash(skew[1])


def test_an_array_times_a_pose_is_a_pose():
    T = rs.Pose.at(0, 0, 1).matrix
    np.testing.assert_array_equal((np.asarray(T) @ POSE).matrix, T @ POSE.matrix)


def test_a_batch_of_poses_is_indexed_by_its_own_shape():
    poses = rs.Pose.exp(np.arange(12.0).reshape(2, 1, 6) / 10)
    np.testing.assert_array_equal(poses[1, 0].matrix, poses.matrix[1, 0])
    np.testing.assert_array_equal(poses[:, 0].matrix, poses.matrix[:, 0])
    with pytest.raises(rs.errors.InputError, match=r"batch of poses of shape \(2, 1\)"):
        poses[0, 0, 0]


def test_an_empty_batch_is_a_batch():
    assert rs.Pose(np.empty((0, 4, 4))).inv().matrix.shape == (0, 4, 4)


@pytest.mark.parametrize(
    "make",
    [
        lambda: rs.Block(1, 1, 1, pose=BATCH),
        lambda: rs.joints.Joint("revolute", place=BATCH),
        lambda: rs.Object("o", pose=BATCH),
        lambda: rs.MountedCamera("c", rs.Camera(np.eye(3)), pose=BATCH),
        lambda: rs.robots.rhino_xr4().at(BATCH),
        lambda: rs.Scene(display=BATCH),
        lambda: rs.GoalPose(BATCH),
    ],
)
def test_one_pose_is_not_a_batch(make):
    with pytest.raises(rs.errors.InputError, match=r"expected one pose, got a batch \(2,\)"):
        make()


def test_a_matrix_is_taken_where_a_pose_is():
    assert rs.Block(1, 1, 1, pose=np.eye(4)) == rs.Block(1, 1, 1)
    assert rs.joints.Joint(place=np.eye(4)) == rs.joints.Joint()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rs.joints.Joint("revolute", limits=(1, 2, 3)), "joint limits: expected shape"),
        (lambda: rs.joints.Joint("revolute", limits="ab"), "joint limits: expected numbers"),
        (lambda: rs.joints.Link("a", "b", joint="revolute"), "link 'a': expected a Joint"),
        (lambda: rs.joints.Link("a", "b", shapes=[1]), "link 'a': shapes are Block"),
        (lambda: rs.Object("o", shapes=3), "object 'o': shapes are Block"),
        (lambda: rs.Camera(np.eye(3), body="x"), "body: expected a CameraBody"),
        (lambda: rs.Scene(None), "robots must be a list"),
        (lambda: rs.Pose.at(rpy=np.zeros((3, 2))), r"rpy: expected shape \(..., 3\)"),
        (lambda: rs.Pose.at([0, 1], [0, 1, 2]), r"unequal shapes \(2,\), \(3,\), \(\)"),
        (lambda: rs.Pose.at(frames="ab"), "frames are two names"),
        (
            lambda: rs.Robot("r", [rs.joints.Link("base"), rs.joints.Link("a", "nope")]),
            "no such frame",
        ),
        (
            lambda: rs.Robot("r", [rs.joints.Link("a", joint=rs.joints.Joint("revolute"))]),
            "is the base",
        ),
    ],
)
def test_an_unsuitable_value_is_refused_at_once(make, message):
    with pytest.raises(rs.errors.InputError, match=message):
        make()


def test_a_link_takes_one_shape_as_well_as_several():
    block = rs.Block(1, 1, 1)
    assert rs.joints.Link("a", "b", shapes=block) == rs.joints.Link("a", "b", shapes=[block])


def test_beyond_the_reach_of_the_lens_there_is_no_point():
    """Brown's polynomial with k1 = -0.3 folds back at 1.054; its image ends at 0.703."""
    lens = rs.Camera(np.eye(3), distortion=(-0.3, 0, 0, 0))
    x = lens.normalise([[0.70, 0], [0.8, 0], [2, 0]])
    assert x[0, 0] == pytest.approx(1.0, abs=1e-12)  # 1 - 0.3 = 0.7
    assert np.isnan(x[1:]).all()


def test_poses_of_a_scene_without_robots():
    scene = rs.Scene(objects=rs.Object("cup", marks=[[0, 0, 0]], pose=POSE.matrix))
    np.testing.assert_array_equal(scene.pose("cup").matrix, POSE.matrix)


def test_copies_are_read_only_like_the_original():
    for again in (copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))):
        rhino, cube, eye = (again(value) for value in values()[1:4])
        for array in (rhino.home, cube.marks, eye.K):
            assert not array.flags.writeable


def test_integrating_a_robot_is_exact():
    """A revolute joint adds; a floating one moves by T exp(V dt), whatever the steps."""
    arm = rs.robots.puma560()
    np.testing.assert_allclose(arm.integrate(arm.home, np.arange(6.0), 0.1) - arm.home,
                               0.1 * np.arange(6.0), atol=1e-15)  # fmt: skip
    fly, V = rs.robots.free_camera(), np.array([0.1, -0.2, 0.3, 0.5, 0.4, -0.6])
    once = fly.integrate(POSE, V, 1.0)
    expected = rs.Pose(POSE.matrix) @ rs.Pose.exp(V)
    np.testing.assert_allclose(fly.fk(once), expected.matrix, atol=1e-14)
    q = np.array(POSE.q)
    for _ in range(10):
        q = fly.integrate(q, V, 0.1)
    np.testing.assert_allclose(fly.fk(q), expected.matrix, atol=1e-14)
    batch = fly.integrate(POSE, np.stack([V, 0 * V]), 1.0)
    np.testing.assert_array_equal(batch[0], once)


def test_the_base_frame_is_where_the_robot_stands():
    place = rs.Pose.at(0, 0, 1, rpy=(0.3, 0, 0))
    base = rs.joints.Link("base", joint=rs.joints.Joint(place=place))
    arm = rs.Robot("arm", [base, rs.joints.Link("a", "base", rs.joints.Joint("prismatic"))])
    np.testing.assert_array_equal(arm.fk([0.5], "base"), np.eye(4))
    np.testing.assert_allclose(arm.fk([0.5])[:3, 3], [0, 0, 0.5])
    np.testing.assert_array_equal(rs.Scene([arm]).pose("arm.base").matrix, place.matrix)


def test_a_copy_of_a_goal_by_robot_cannot_be_changed_either():
    goal = rs.tasks.TaughtGoal({"arm": [0.1, 0.2]})
    for copied in (copy.deepcopy(goal), pickle.loads(pickle.dumps(goal))):
        assert copied == goal
        with pytest.raises(ValueError, match="read-only"):
            copied.q["arm"][0] = 1.0
