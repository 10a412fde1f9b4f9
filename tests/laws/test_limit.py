"""Speed limits scale the whole command."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.base.errors import InputError
from robsim.servo.shaping.speed_limit import SpeedLimit

steady = settings(derandomize=True, max_examples=25, deadline=None)
LIMITS = [
    SpeedLimit(joint=0.5),
    SpeedLimit(joint=[0.1, 0.2, 0.3, 0.4, 0.5]),
    SpeedLimit(linear=0.3),
    SpeedLimit(angular=0.4),
    SpeedLimit(joint=1.0, linear=0.3, angular=0.4),
]


def commands(seed, runs=20):
    rng = np.random.default_rng(seed)
    size = 10 ** rng.uniform(-2, 1, runs)
    return rng.normal(size=(5, runs)) * size, rng.normal(size=(6, 5, runs))


def shares(limit, qd, J):
    """How much of each of its limits a command uses (limits, B)."""
    V = np.einsum("cjb,jb->cb", J, qd)
    used = []
    if limit.joint is not None:
        used += list(np.abs(qd) / np.broadcast_to(limit.joint, (5,))[:, None])
    if limit.linear is not None:
        used.append(np.linalg.norm(V[:3], axis=0) / limit.linear)
    if limit.angular is not None:
        used.append(np.linalg.norm(V[3:], axis=0) / limit.angular)
    return np.array(used)


@pytest.mark.parametrize("limit", LIMITS)
@steady
@given(seed=st.integers(0, 2**32))
def test_a_command_that_is_too_fast_just_meets_its_limit_and_keeps_its_direction(limit, seed):
    qd, J = commands(seed)
    slow = limit.scaled(qd, J)
    wanted, used = shares(limit, qd, J).max(axis=0), shares(limit, slow, J).max(axis=0)
    np.testing.assert_allclose(used, np.minimum(wanted, 1.0), rtol=1e-13)
    np.testing.assert_allclose(slow, qd / np.maximum(wanted, 1.0), rtol=1e-13)
    np.testing.assert_array_equal(slow[:, wanted <= 1], qd[:, wanted <= 1])


def test_rest_stays_rest():
    np.testing.assert_array_equal(LIMITS[-1].scaled(np.zeros((5, 3)), np.ones((6, 5, 3))), 0)


def test_a_command_that_is_not_finite_stays_so_and_leaves_others_alone():
    qd, J = commands(1)
    clean = LIMITS[-1].scaled(qd, J)
    qd[2, 4], qd[0, 7] = np.nan, np.inf
    spoilt = LIMITS[-1].scaled(qd, J)
    assert not np.isfinite(spoilt[:, [4, 7]]).all(axis=0).any()
    others = np.setdiff1d(np.arange(20), [4, 7])
    np.testing.assert_array_equal(spoilt[:, others], clean[:, others])


@pytest.mark.parametrize("limit", LIMITS)
def test_a_run_does_not_depend_on_its_batch(limit):
    qd, J = commands(2, 37)
    whole = limit.scaled(qd, J)
    for part in (slice(0, 1), slice(3, 20), slice(36, None)):
        some = np.ascontiguousarray(qd[:, part]), np.ascontiguousarray(J[..., part])
        np.testing.assert_array_equal(limit.scaled(*some), whole[:, part])


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("again", [copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))])
def test_it_is_a_value(limit, again):
    assert again(limit) == limit and hash(again(limit)) == hash(limit)
    assert [other == limit for other in LIMITS].count(True) == 1


def test_one_limit_for_each_commanded_velocity_or_one_for_all():
    SpeedLimit(joint=1.0).check(["a", "b", "c"])
    SpeedLimit(linear=1.0).check(["a", "b", "c"])
    SpeedLimit(joint=(1, 2, 3)).check(["a", "b", "c"])
    with pytest.raises(InputError, match="2 joint speed limits for 3 commanded velocities: a, b"):
        SpeedLimit(joint=np.array([1, 2])).check(["a", "b", "c"])


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({}, "at least one of joint, linear and angular"),
        ({"joint": 0}, "SpeedLimit.joint must be a positive number"),
        ({"joint": [1, -1]}, "SpeedLimit.joint must be a positive number"),
        ({"joint": []}, "SpeedLimit.joint must be a positive number"),
        ({"joint": [[1.0]]}, "SpeedLimit.joint must be a positive number"),
        ({"joint": "fast"}, "SpeedLimit.joint: expected a number"),
        ({"joint": [1, np.inf]}, "SpeedLimit.joint: inf at index"),
        ({"linear": -1}, "SpeedLimit.linear must be a positive number .m/s., got -1"),
        ({"angular": np.nan}, "SpeedLimit.angular: nan"),
        ({"angular": [1.0]}, "SpeedLimit.angular must be a positive number"),
    ],
)
def test_an_invalid_limit_is_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        SpeedLimit(**arguments)
