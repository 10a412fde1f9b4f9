"""Inverse kinematics gives the same bits alone, in any batch, and with any number of threads."""

import numpy as np
import pytest

import robsim as rs
from robsim.robot.ik import ik_search
from robsim.robot.ik.ik_result import IKResult

FIELDS = ["q", "success", "error", "iterations", "restarts", "reason"]


def goals(robot, count=150):
    """Some that are reached at once, some after restarts, beyond the limits alone, or never."""
    rng = np.random.default_rng(4)
    q = rng.uniform(*robot.limits.T, (count, robot.nq))
    q[1::5] = rng.uniform(-np.pi, np.pi, (count // 5, robot.nq))
    T = robot.fk(q)
    T[::5, :3, 3] *= 1.5
    return T


@pytest.fixture(scope="module", params=["puma560", "panda"])
def whole(request):
    robot = rs.robots.load(request.param)
    T = goals(robot)
    found = robot.ik(T, threads=1)
    assert len(np.unique(found.reason)) >= 3 and len(np.unique(found.restarts)) > 5
    return robot, T, found


def same(a, b):
    for name in FIELDS:
        x, y = np.asarray(getattr(a, name)), np.asarray(getattr(b, name))
        assert x.shape == y.shape and x.tobytes() == y.tobytes(), name


def rows(found, which):
    return IKResult(*(getattr(found, name)[which] for name in FIELDS))


def test_a_single_pose_equals_its_row_in_a_batch(whole):
    robot, T, found = whole
    for i in range(25):
        same(robot.ik(T[i]), rows(found, i))


@pytest.mark.parametrize(
    "some", [slice(3, 4), slice(7, 80), slice(None, None, -1), slice(1, None, 7)]
)
def test_the_other_rows_of_a_batch_do_not_matter(whole, some):
    robot, T, found = whole
    same(robot.ik(T[some]), rows(found, some))


@pytest.mark.parametrize("chunk", [1, 7, 64, 4096])
@pytest.mark.parametrize("threads", [1, 2, 3])
def test_chunks_and_threads_do_not_matter(whole, chunk, threads, monkeypatch):
    robot, T, found = whole
    monkeypatch.setattr(ik_search, "LARGEST_CHUNK", chunk)
    same(robot.ik(T, threads=threads), found)


def test_the_shape_of_a_batch_does_not_matter(whole):
    robot, T, found = whole
    shaped = robot.ik(T.reshape(5, 30, 4, 4), robot.home)
    assert shaped.q.shape == (5, 30, robot.nq) and shaped.error.shape == (5, 30)
    same(rows(shaped, slice(None)), IKResult(*(_shaped(getattr(found, n)) for n in FIELDS)))


def _shaped(array):
    return array.reshape(5, 30, *array.shape[1:])


def test_another_seed_begins_elsewhere_but_not_where_no_restart_was_needed(whole):
    robot, T, found = whole
    other = robot.ik(T, seed=1)
    at_once = (found.restarts == 0) & found.success
    assert (other.q[at_once] == found.q[at_once]).all()
    assert (other.q[~at_once] != found.q[~at_once]).any()
    same(robot.ik(T, seed=1), other)


def test_a_start_beyond_half_a_turn_is_the_same_alone_and_late_in_a_batch():
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 0.7, 0]], home=[0.1, 0.1])
    T = arm.fk([[0.5, 0.6]] * 100)
    found = arm.ik(T, [5.0, -4.0], mask="position", threads=1)
    for i in (0, 7, 8, 99):
        same(arm.ik(T[i], [5.0, -4.0], mask="position"), rows(found, i))
    np.testing.assert_allclose(found.q[99], [0.5, 0.6], atol=1e-7)
