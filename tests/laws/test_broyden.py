"""Broyden's estimate of a Jacobian."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.base.errors import InputError
from robsim.servo.laws.broyden_rule import Broyden, broyden_update

steady = settings(derandomize=True, max_examples=25, deadline=None)
seeds, sizes = st.integers(0, 2**32), st.integers(1, 8)


def systems(seed, k, n, runs=7):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(k, n, runs)), rng.normal(size=(k, runs)), rng.normal(size=(n, runs))


def times(A, x):
    return np.einsum("knb,nb->kb", A, x)


@steady
@given(seeds, sizes, sizes)
def test_the_new_estimate_explains_the_step_and_is_the_nearest_that_does(seed, k, n):
    A, ds, dq = systems(seed, k, n)
    new = broyden_update(A, ds, dq)
    size = 1 + np.abs(new).max()
    np.testing.assert_allclose(times(new, dq), ds, atol=1e-13 * size)
    across = np.random.default_rng(seed + 1).normal(size=dq.shape)
    across -= dq * (dq * across).sum(0) / (dq**2).sum(0)
    np.testing.assert_allclose(times(new, across), times(A, across), atol=1e-12 * size)


@steady
@given(seeds, sizes, sizes)
def test_a_linear_map_is_found_after_as_many_orthogonal_steps_as_joints(seed, k, n):
    A, _, _ = systems(seed, k, n, 1)
    rng = np.random.default_rng(seed + 1)
    steps, _ = np.linalg.qr(rng.normal(size=(n, n)))
    estimate = rng.normal(size=A.shape)
    for step in 0.01 * steps.T:
        dq = np.ascontiguousarray(step[:, None])
        estimate = broyden_update(estimate, times(A, dq), dq)
    np.testing.assert_allclose(estimate, A, atol=1e-12)


@steady
@given(seeds, sizes, sizes)
def test_the_estimate_of_a_linear_map_never_gets_worse(seed, k, n):
    """Whatever the steps: the error is multiplied by I - dq dq'/(dq'dq)."""
    A, _, _ = systems(seed, k, n, 1)
    rng = np.random.default_rng(seed + 1)
    estimate = rng.normal(size=A.shape)
    error = np.inf
    for _ in range(30):
        dq = rng.normal(size=(n, 1))
        estimate = broyden_update(estimate, times(A, dq), dq)
        assert np.linalg.norm(estimate - A) <= error * (1 + 1e-12) + 1e-14
        error = np.linalg.norm(estimate - A)


@pytest.mark.parametrize("size", [0.0, 1e-200, 1e-12, 5e-10])
def test_no_motion_changes_nothing(size):
    A, ds, dq = systems(0, 8, 6)
    still = broyden_update(A, ds, np.where(np.arange(7) < 3, size, 1.0) * dq / 6)
    np.testing.assert_array_equal(still[..., :3], A[..., :3])
    assert (still[..., 3:] != A[..., 3:]).any(axis=(0, 1)).all()
    assert np.isfinite(still).all()


def test_the_estimate_is_a_new_array_and_does_not_depend_on_the_batch():
    A, ds, dq = systems(1, 8, 6, 37)
    before = A.copy()
    whole = broyden_update(A, ds, dq)
    np.testing.assert_array_equal(A, before)
    for part in (slice(0, 1), slice(3, 20), slice(36, None)):
        some = (np.ascontiguousarray(a[..., part]) for a in (A, ds, dq))
        np.testing.assert_array_equal(broyden_update(*some), whole[..., part])


def test_a_start_is_kept_as_a_value():
    given = np.arange(6.0).reshape(3, 2)
    start = Broyden(given)
    given[:] = 0
    np.testing.assert_array_equal(start.start, [[0, 1], [2, 3], [4, 5]])
    for again in (copy.deepcopy(start), pickle.loads(pickle.dumps(start))):
        assert again == start and hash(again) == hash(start) and not again.start.flags.writeable
    assert start != Broyden() and Broyden() == Broyden()


@pytest.mark.parametrize(
    "start, message",
    [
        ([[1, 2], [2, 4]], r"singular: rank 1; shape \(2, 2\) needs 2"),
        (np.zeros((8, 6)), r"singular: rank 0; shape \(8, 6\) needs 6"),
        ([1, 2], r"expected shape \(..., k, n\), got \(2,\)"),
        (np.ones((2, 2, 2)), r"one matrix of shape \(k, n\), got \(2, 2, 2\)"),
        (np.ones((0, 2)), r"one matrix of shape \(k, n\), got \(0, 2\)"),
        ([[1, np.nan]], r"Broyden start: nan at index \(0, 1\)"),
        ("model", "Broyden start: expected numbers"),
        ([[1, 2], [3]], "Broyden start: expected numbers"),
    ],
)
def test_an_invalid_start_is_refused(start, message):
    with pytest.raises(InputError, match=message):
        Broyden(start)


def test_a_jacobian_of_seven_joints_has_the_rank_of_a_twist():
    """L J (8, 7) of rank 6 is a start; of rank 5 it is singular."""
    rng = np.random.default_rng(12)
    L, J = rng.normal(size=(8, 6)), rng.normal(size=(6, 7))
    assert Broyden(L @ J).start.shape == (8, 7)
    with pytest.raises(InputError, match="rank 5; shape \\(8, 7\\) needs 6"):
        Broyden(L[:, :5] @ J[:5])
