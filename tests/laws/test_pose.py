"""Poses: a group that acts on points, its charts, its batches, and its refusals."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.base.errors import FrameError, InputError
from robsim.geometry.pose import IDENTITY, Pose, as_pose
from robsim.geometry.rotation import axis_rotation

steady = settings(derandomize=True, max_examples=30, deadline=None)

coordinates = st.floats(-10, 10, allow_nan=False)
triples = st.tuples(coordinates, coordinates, coordinates)
# the whole band of angles, and both of its ends
angles = st.floats(-12, math.log10(math.pi)).map(lambda x: min(10.0**x, math.pi)) | st.sampled_from(
    [0.0, *(math.pi - 10.0**-k for k in range(1, 13)), math.pi]
)
axes = triples.filter(lambda u: np.linalg.norm(u) > 0.1).map(
    lambda u: np.array(u) / np.linalg.norm(u)
) | st.sampled_from(tuple(np.concatenate([np.eye(3), -np.eye(3)])))
rotvecs = st.builds(lambda u, angle: angle * u, axes, angles)
poses = st.builds(lambda p, w: Pose.at(*p, rotvec=w), triples, rotvecs)


def close(a, b, tolerance=1e-12):
    np.testing.assert_allclose(np.asarray(a), np.asarray(b), rtol=0, atol=tolerance)


# the group and its action


@steady
@given(poses, poses, poses)
def test_joining_is_associative(a, b, c):
    close((a @ b) @ c, a @ (b @ c))


@steady
@given(poses)
def test_the_identity_changes_nothing(T):
    close(T @ IDENTITY, T, 0)
    close(IDENTITY @ T, T, 0)


@steady
@given(poses, poses)
def test_the_inverse_undoes(a, b):
    close(a @ a.inv(), np.eye(4))
    close(a.inv() @ a, np.eye(4))
    close((a @ b).inv(), b.inv() @ a.inv())
    close(a.inv().inv(), a)


@steady
@given(poses, poses, st.lists(triples, min_size=1, max_size=5))
def test_acting_on_points_is_an_action(a, b, points):
    close((a @ b) @ points, a @ (b @ points))
    close(IDENTITY @ points, points, 0)
    close(a @ points[0], (a @ points)[0])


@steady
@given(poses, triples, triples)
def test_distances_and_handedness_stay(T, p, r):
    moved = T @ np.array([p, r])
    before, after = np.subtract(p, r), moved[0] - moved[1]
    assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before), abs=1e-12)
    assert np.linalg.det(T.rotation) == pytest.approx(1.0, abs=1e-13)


@steady
@given(triples, rotvecs)
def test_a_point_is_turned_and_then_shifted_by_the_formula_of_rodrigues(p, w):
    """p' = p cos t + (u x p) sin t + u (u.p)(1 - cos t), with t u the rotation vector."""
    t = np.linalg.norm(w)
    u, x = w / t if t else np.zeros(3), np.array([0.3, -0.2, 0.7])
    turned = (
        x * np.cos(t) + np.cross(u, x) * np.sin(t) + u * (u @ x) * 2 * np.sin(t / 2) ** 2
        if t
        else x
    )
    close(Pose.at(*p, rotvec=w) @ x, turned + p, 1e-14)


def test_half_the_twist_twice_is_the_twist():
    twist = np.array([0.3, -1.0, 2.0, 0.4, -0.5, 1.2])
    close(Pose.exp(twist / 2) @ Pose.exp(twist / 2), Pose.exp(twist), 1e-15)
    close(Pose.exp(-twist), Pose.exp(twist).inv(), 1e-15)


def test_a_quarter_turn_about_an_axis_off_the_origin_is_a_quarter_of_a_circle():
    """v = -omega x c turns about the point c."""
    centre, omega = np.array([1.0, 0, 0]), np.array([0, 0, np.pi / 2])
    T = Pose.exp([*-np.cross(omega, centre), *omega])
    close(T @ [2, 0, 5], [1, 1, 5], 1e-15)
    close(T @ centre, centre, 1e-15)


# charts of rotation


@steady
@given(st.tuples(*[st.floats(-7, 7)] * 3))
def test_roll_pitch_yaw_agree_with_urdf(rpy):
    """R = Rz(yaw) Ry(pitch) Rx(roll), written out."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    close(Pose.at(rpy=rpy).rotation, Rz @ Ry @ Rx, 1e-15)


@pytest.mark.parametrize(
    ("rpy", "images"),
    [
        ((np.pi / 2, 0, 0), ([1, 0, 0], [0, 0, 1], [0, -1, 0])),
        ((0, np.pi / 2, 0), ([0, 0, -1], [0, 1, 0], [1, 0, 0])),
        ((0, 0, np.pi / 2), ([0, 1, 0], [-1, 0, 0], [0, 0, 1])),
        ((np.pi / 2, 0, np.pi / 2), ([0, 1, 0], [0, 0, 1], [1, 0, 0])),
    ],
)
def test_quarter_turns_carry_the_axes_by_the_right_hand_rule(rpy, images):
    close(Pose.at(rpy=rpy).rotation.T, images, 1e-15)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_angle_of_rpy_is_a_rotation_vector_along_its_axis(axis):
    alone = 0.7 * np.eye(3)[axis]
    close(Pose.at(rpy=alone), Pose.at(rotvec=alone), 1e-15)
    close(axis_rotation("xyz"[axis], 0.7), Pose.at(rotvec=alone).rotation, 1e-15)


@steady
@given(rotvecs)
def test_a_rotation_vector_comes_back(w):
    """Near pi the matrix holds the angle to 1e-8 only, and at pi either axis is right."""
    near_pi = math.pi - np.linalg.norm(w) < 1e-7
    back = Pose.at(rotvec=w).rotvec
    if near_pi and back @ w < 0:
        back = -back
    close(back, w, 1e-8 if near_pi else 4e-15)
    assert np.linalg.norm(back) <= math.pi + 1e-15


@steady
@given(axes, st.floats(-12, -3))
def test_a_small_rotation_vector_comes_back_with_all_its_digits(u, exponent):
    w = 10.0**exponent * u
    assert np.linalg.norm(Pose.at(rotvec=w).rotvec - w) <= 1e-15 * np.linalg.norm(w)


@steady
@given(axes, st.floats(-3 * math.pi, 3 * math.pi))
def test_a_longer_rotation_vector_is_the_same_rotation_as_the_shortest(u, angle):
    T = Pose.at(rotvec=angle * u)
    close(Pose.at(rotvec=T.rotvec).rotation, T.rotation, 3e-15)


@steady
@given(triples, rotvecs)
def test_position_and_quaternion_come_back(p, w):
    T = Pose.at(*p, rotvec=w)
    back = Pose.from_quaternion(T.position, T.quaternion)
    close(back, T, 4e-15)
    close(T.q, [*p, *T.quaternion], 0)
    assert T.quaternion[3] >= 0
    assert np.linalg.norm(T.quaternion) == pytest.approx(1.0, abs=1e-15)


@steady
@given(rotvecs)
def test_the_quaternion_is_the_half_angle_and_the_axis(w):
    t = np.linalg.norm(w)
    half = np.append(np.sin(t / 2) * w / t if t else np.zeros(3), np.cos(t / 2))
    q = Pose.at(rotvec=w).quaternion
    close(q if q @ half > 0 else -q, half, 1e-15)


@steady
@given(rotvecs)
def test_a_quaternion_and_its_negative_are_one_rotation(w):
    q = Pose.at(rotvec=w).quaternion
    assert Pose.from_quaternion([0, 0, 0], -q) == Pose.from_quaternion([0, 0, 0], q)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_a_turn_has_length_pi(axis):
    T = Pose.at(rotvec=np.pi * axis)
    assert np.linalg.norm(T.rotvec) == pytest.approx(np.pi, abs=1e-15)
    close(T.rotation, 2 * np.outer(axis, axis) - np.eye(3), 1e-15)


# batches


@pytest.fixture
def batch():
    return Pose.exp(np.random.default_rng(3).normal(size=(2, 5, 6)))


@pytest.mark.parametrize(
    "of",
    [
        lambda T: T.matrix,
        lambda T: T.inv().matrix,
        lambda T: T.position,
        lambda T: T.rotation,
        lambda T: T.rotvec,
        lambda T: T.quaternion,
        lambda T: T.q,
        lambda T: (T @ T).matrix,
        lambda T: (T @ Pose.at(1, 2, 3, rpy=(1, 2, 3))).matrix,
        lambda T: (Pose.at(1, 2, 3, rpy=(1, 2, 3)) @ T).matrix,
        lambda T: T @ [1.0, 2.0, 3.0],
        lambda T: T @ np.arange(12.0).reshape(4, 3),
        lambda T: Pose.from_quaternion(T.position, T.quaternion).matrix,
    ],
)
def test_a_batch_is_a_loop_over_its_poses(batch, of):
    whole = of(batch)
    for index in np.ndindex(2, 5):
        close(whole[index], of(batch[index]), 1e-14)


def test_a_batch_of_points_meets_a_batch_of_poses_row_by_row(batch):
    points = np.random.default_rng(4).normal(size=(2, 5, 7, 3))
    whole = batch @ points
    assert whole.shape == (2, 5, 7, 3)
    close(whole[1, 3], batch[1, 3] @ points[1, 3], 1e-15)


def test_the_exponential_of_a_batch_agrees_with_each_twist_bit_for_bit():
    twists = np.random.default_rng(5).normal(size=(9, 6))
    np.testing.assert_array_equal(
        Pose.exp(twists).matrix, [Pose.exp(twist).matrix for twist in twists]
    )


def test_part_of_a_batch_is_a_batch(batch):
    assert batch[1].matrix.shape == (5, 4, 4)
    assert batch[:, 2:4].matrix.shape == (2, 2, 4, 4)
    close(batch[1][3], batch[1, 3], 0)


def test_a_single_pose_has_nothing_to_index():
    with pytest.raises(InputError, match="single pose, not a batch"):
        Pose.at()[0]


# frames


def test_frames_that_meet_are_joined_and_turned_round():
    T_w_b = Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3), frames=("world", "base"))
    T_b_t = Pose.at(0, 0, 1, frames=("base", "tool"))
    assert (T_w_b @ T_b_t).frames == ("world", "tool")
    assert T_w_b.inv().frames == ("base", "world")
    assert (T_w_b.inv() @ T_w_b).frames == ("base", "base")


def test_frames_that_do_not_meet_are_named_both():
    T_w_b, T_t_c = Pose.at(frames=("world", "base")), Pose.at(frames=("tool", "cup"))
    with pytest.raises(FrameError) as caught:
        T_w_b @ T_t_c
    message = "cannot join world<-base with tool<-cup: 'base' does not meet 'tool'"
    assert str(caught.value) == message


def test_a_pose_without_names_joins_anything_and_gives_no_names():
    named = Pose.at(frames=("world", "base"))
    assert (named @ Pose.at(1, 0, 0)).frames is None
    assert (Pose.at(1, 0, 0) @ named).frames is None


def test_every_pose_of_a_batch_keeps_the_names(batch):
    named = Pose(batch, ("world", "camera"))
    assert named[0, 1].frames == ("world", "camera")


@pytest.mark.parametrize("frames", [("a",), ("a", "b", "c"), (1, 2), ("a", None)])
def test_frames_are_two_names(frames):
    with pytest.raises(FrameError, match="frames are two names"):
        Pose.at(frames=frames)


# what else is called a pose


class RigidTransform:
    """As SciPy's: the array comes from a method."""

    def __init__(self, T):
        self.T = T

    def as_matrix(self):
        return self.T


class SE3:
    """As spatialmath's: the array is an attribute, a list of arrays for several poses."""

    def __init__(self, A):
        self.A = A


FOREIGN = pytest.mark.parametrize(
    "dress", [np.asarray, np.ndarray.tolist, RigidTransform, SE3], ids=lambda d: d.__name__
)


@FOREIGN
def test_the_poses_of_other_libraries_are_accepted(dress):
    T = Pose.at(1, 2, 3, rpy=(0.1, -0.2, 0.3))
    other = dress(T.matrix)
    assert Pose(other) == as_pose(other) == T
    close(IDENTITY @ other, T, 0)
    close(T.inv() @ other, np.eye(4), 1e-15)


@FOREIGN
def test_and_so_are_several_of_them(dress, batch):
    assert Pose(dress(batch[0].matrix)) == batch[0]


def test_a_list_of_arrays_as_spatialmath_keeps_them_is_a_batch(batch):
    assert Pose(SE3(list(batch[0].matrix))) == batch[0]


def test_numpy_takes_a_pose_for_its_matrix():
    T = Pose.at(1, 2, 3)
    assert np.asarray(T).tolist() == T.matrix.tolist()
    assert np.linalg.det(T) == 1.0


# refusals

LEFT_HANDED = np.diag([1.0, 1.0, -1.0, 1.0])
SHEARED = np.eye(4) + 1e-3 * np.eye(4, k=1)
PROJECTIVE = np.eye(4) + np.diag([1e-9], -3)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (2 * np.eye(4), "not a rotation: R'R differs from the identity by 3"),
        (SHEARED, "not a rotation: R'R differs from the identity by 0.001 (allowed 1e-06)"),
        (np.zeros((4, 4)), "not a rotation"),
        (LEFT_HANDED, "not a rotation but a reflection: det R = -1"),
        (-np.eye(4), "not a rotation but a reflection"),
        (PROJECTIVE, "the last row of a pose must be 0 0 0 1"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "the last row of a pose must be 0 0 0 1"),
        (np.eye(4) * [1, 1, 1, np.nan], "pose: nan at index (0, 3)"),
        (np.eye(4) + np.diag([np.inf], 3), "pose: inf at index (0, 3)"),
        (np.eye(3), "pose: expected shape (..., 4, 4), got (3, 3)"),
        (np.eye(4)[:3], "pose: expected shape (..., 4, 4), got (3, 4)"),
        (1.0, "pose: expected shape (..., 4, 4), got ()"),
        ("identity", "pose: expected numbers of shape (..., 4, 4), got 'identity'"),
        (None, "pose: "),
    ],
)
def test_an_invalid_rigid_motion_is_refused(matrix, words):
    with pytest.raises(InputError) as caught:
        Pose(matrix)
    assert words in str(caught.value)


def test_one_bad_pose_spoils_a_batch():
    with pytest.raises(InputError, match="reflection"):
        Pose([np.eye(4), LEFT_HANDED, np.eye(4)])


def test_rounding_is_forgiven_and_the_numbers_are_kept():
    T = np.round(Pose.at(rpy=(0.1, 0.2, 0.3)).matrix, 8)
    np.testing.assert_array_equal(Pose(T).matrix, T)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Pose.at(np.nan, 0, 0), "position: nan at index"),
        (lambda: Pose.at("a", 0, 0), "position x: expected a number"),
        (lambda: Pose.at(rpy=(0, 0)), r"rpy: expected shape \(..., 3\), got \(2,\)"),
        (lambda: Pose.at(rotvec=(0, 0, np.inf)), "rotvec: inf at index"),
        (lambda: Pose.exp([1, 2, 3]), r"twist: expected shape \(..., 6\)"),
        (lambda: Pose.exp([0, 0, 0, 0, 0, np.nan]), "twist: nan at index"),
        (lambda: Pose.from_quaternion([0, 0, 0], [0, 0, 0, 0]), "must have length 1"),
        (lambda: Pose.from_quaternion([0, 0, 0], [0, 0, 1, 1]), "must have length 1"),
        (lambda: Pose.from_quaternion([0, 0, 0], [0, 0, 1]), "quaternion: expected shape"),
        (lambda: Pose.from_quaternion([0, np.inf, 0], [0, 0, 0, 1]), "position: inf at index"),
        (lambda: Pose.at() @ [1, 2], r"points: expected shape \(..., 3\)"),
        (lambda: Pose.at() @ [1, 2, np.nan], "points: nan at index"),
        (lambda: Pose.at() @ "here", "points: expected numbers"),
    ],
)
def test_bad_numbers_are_refused_by_name(make, words):
    with pytest.raises(InputError, match=words):
        make()


# values


def test_a_pose_is_a_value():
    pose, same = Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3)), Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3))
    assert pose == same
    assert hash(pose) == hash(same)
    assert pose != Pose.at(1, 2, 3)
    assert pose != Pose(pose, ("a", "b"))
    assert pose != pose.matrix.tolist()


@pytest.mark.parametrize("name", ["matrix", "frames", "position", "anything"])
def test_a_pose_cannot_be_changed(name):
    with pytest.raises(AttributeError, match="a Pose is a value: make a new one"):
        setattr(Pose.at(), name, np.eye(4))


@pytest.mark.parametrize(
    "pose",
    [
        Pose.at(),
        Pose(np.eye(4)),
        Pose.exp(np.zeros(6)),
        Pose.at().inv(),
        Pose.at() @ Pose.at(),
        Pose.exp(np.zeros((3, 6)))[1:],
        Pose.from_quaternion([0, 0, 0], [0, 0, 0, 1]),
    ],
)
def test_its_matrix_is_read_only(pose):
    with pytest.raises(ValueError, match="read-only"):
        pose.matrix[..., 0, 3] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        pose.position[..., 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        pose.rotation[..., 0, 0] = 1.0


def test_arrays_are_copied_in_and_out():
    T = np.eye(4)
    pose = Pose(T)
    T[0, 3] = 7.0
    out = np.array(pose)
    out[1, 3] = 7.0
    assert pose == IDENTITY


def test_a_pose_is_printed_as_position_and_rotation_vector():
    T = Pose.at(1, 2, 3, rotvec=(0, 0, 0.5), frames=("world", "tool"))
    assert repr(T) == "<Pose world<-tool position [1.0, 2.0, 3.0] rotvec [0.0, 0.0, 0.5]>"
    assert repr(Pose.exp(np.zeros((2, 5, 6)))) == "<Pose batch (2, 5)>"
