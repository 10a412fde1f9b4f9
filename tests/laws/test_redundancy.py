"""Projectors, priorities and secondary motions, against NumPy's singular values."""

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.base.errors import InputError
from robsim.kernels.control.null_space import sigmoid_switch
from robsim.kernels.machine.program import evaluate_stages
from robsim.servo.shaping.free_motions import add_camera_priorities, add_priorities
from robsim.servo.shaping.redundancy import (
    AvoidLimits,
    Posture,
    SecondaryMotion,
    large_projection,
    null_space,
    solve_priorities,
)
from robsim.servo.shaping.row_space import RowSpace
from robsim.servo.task_product import TaskProduct

RCOND = 1e-6
steady = settings(derandomize=True, max_examples=30, deadline=None)
seeds, sizes = st.integers(0, 2**32), st.integers(1, 8)


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def of_rank(rng, k, n, rank):
    return rng.normal(size=(k, rank)) @ rng.normal(size=(rank, n))


def last(*matrices):
    """A batch of these runs."""
    return np.ascontiguousarray(np.stack(matrices, axis=-1))


def is_projector(P, tolerance):
    close(P, P.T, tolerance)
    close(P @ P, P, tolerance)


# the null space


@steady
@given(seeds, sizes, sizes)
def test_the_projector_onto_the_null_space_agrees_with_the_pseudo_inverse(seed, k, n):
    rng = np.random.default_rng(seed)
    A = [of_rank(rng, k, n, rng.integers(0, min(k, n) + 1)) for _ in range(5)]
    P = null_space(last(*A), RCOND)
    for b in range(5):
        close(P[..., b], np.eye(n) - np.linalg.pinv(A[b], rcond=RCOND) @ A[b], 1e-12)
        is_projector(P[..., b], 1e-13)
        close(A[b] @ P[..., b], 0, 1e-12 * (1 + np.abs(A[b]).max()))


def test_singular_values_below_rcond_are_free():
    U, V = (np.linalg.qr(np.random.default_rng(s).normal(size=(4, 4)))[0] for s in (1, 2))
    A = last(U * [3.0, 1.0, 1e-5, 1e-7] @ V.T)
    for rcond, rank in ((1e-9, 4), (1e-6, 3), (1e-3, 2), (0.5, 1)):
        P = null_space(A, rcond)[..., 0]
        assert np.trace(P) == pytest.approx(4 - rank, abs=1e-12)
        close(P, V[:, rank:] @ V[:, rank:].T, 1e-9)


# the large projection


def test_the_switch_is_the_sigmoid_scaled_to_meet_its_ends():
    low, high = 0.1, 0.7
    sig = lambda x: 1 / (1 + math.exp(6 - 12 * (x - low) / (high - low)))  # noqa: E731
    x = np.linspace(low, high, 101)
    expected = [(sig(v) - sig(low)) / (sig(high) - sig(low)) for v in x]
    w = [sigmoid_switch(v, low, high) for v in x]
    close(w, expected, 1e-14)
    assert (w[0], w[50], w[-1]) == (0.0, pytest.approx(0.5, abs=1e-14), 1.0)
    assert (np.diff(w) > 0).all()
    assert (sigmoid_switch(0.0, low, high), sigmoid_switch(9.0, low, high)) == (0.0, 1.0)
    nearly = sigmoid_switch(low + 1e-9, low, high), sigmoid_switch(high - 1e-9, low, high)
    close(nearly, [0, 1], 1e-8)  # continuous at both ends


def large(A, e, low, high):
    return large_projection(A, e, low, high, null_space(A, RCOND))


@steady
@given(seeds, sizes, sizes)
def test_far_away_a_secondary_motion_keeps_the_norm_of_the_error(seed, k, n):
    rng = np.random.default_rng(seed)
    A, e, z = rng.normal(size=(k, n, 9)), rng.normal(size=(k, 9)), rng.normal(size=(n, 9))
    P = large(A, e, 0.0, 1e-9)
    rate = np.einsum("kb,knb,nmb,mb->b", e, A, P, z)
    close(rate, 0, 1e-12 * (1 + np.abs(A).max() ** 2))
    for b in range(9):
        is_projector(P[..., b], 1e-13)
        assert np.trace(P[..., b]) == pytest.approx(n - 1, abs=1e-12)


@steady
@given(seeds, sizes, sizes)
def test_near_the_goal_it_is_the_classic_projector(seed, k, n):
    rng = np.random.default_rng(seed)
    A, e = rng.normal(size=(k, n, 9)), rng.normal(size=(k, 9))
    np.testing.assert_array_equal(large(A, e, 100.0, 101.0), null_space(A, RCOND))


@steady
@given(seeds, sizes, sizes)
def test_between_it_is_the_mean_weighed_by_the_switch(seed, k, n):
    rng = np.random.default_rng(seed)
    A, e = rng.normal(size=(k, n, 9)), rng.normal(size=(k, 9))
    far, near, P = large(A, e, 0.0, 1e-9), null_space(A, RCOND), large(A, e, 0.5, 3.0)
    w = np.array([sigmoid_switch(np.linalg.norm(e[:, b]), 0.5, 3.0) for b in range(9)])
    close(P, w * far + (1 - w) * near, 1e-14)


def test_where_the_error_cannot_be_reduced_it_is_the_classic_projector():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(8, 6, 5))
    e = rng.normal(size=(8, 5))
    for b in range(5):  # a local minimum: A'e = 0 but for rounding
        e[:, b] -= A[..., b] @ np.linalg.lstsq(A[..., b], e[:, b], rcond=None)[0]
    e[:, 0], e[:, 1], A[..., 2] = 0.0, 1e-200, 0.0
    np.testing.assert_array_equal(large(A, e, 0.0, 1e-300), null_space(A, RCOND))


# priorities


def lexicographic(levels, rcond=RCOND):
    """The same by nested bases N of the remaining motion: qd = qd + N (A N)^+ (rate - A qd)."""
    n = levels[0][0].shape[1]
    qd, N = np.zeros(n), np.eye(n)
    for A, rate in levels:
        if not N.shape[1]:
            break
        U, sigma, Vt = np.linalg.svd(A @ N)
        rank = int((sigma > rcond * np.linalg.norm(A, 2)).sum())
        y = Vt[:rank].T @ ((U[:, :rank].T @ (rate - A @ qd)) / sigma[:rank])
        qd, N = qd + N @ y, N @ Vt[rank:].T
    return qd, N @ N.T


def stacks(seed, shapes, n, runs=4):
    """Random levels: of full rank, lacking rank, repeating or nearly combining those above."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(runs):
        levels = []
        for k in shapes:
            kind = rng.integers(4) if levels else rng.integers(2)
            above = np.vstack([A for A, _ in levels]) if levels else None
            if kind == 0:
                A = rng.normal(size=(k, n))
            elif kind == 1:
                A = of_rank(rng, k, n, int(rng.integers(0, min(k, n) + 1)))
            elif kind == 2:
                A = rng.normal(size=(k, len(above))) @ above  # can only agree or conflict
            else:
                A = rng.normal(size=(k, len(above))) @ above
                A[: k // 2 + 1] += rng.normal(size=(k // 2 + 1, n))
            levels.append((A, rng.normal(size=k)))
        out.append(levels)
    return out


def batch(stack):
    return [
        (last(*(levels[i][0] for levels in stack)), last(*(levels[i][1] for levels in stack)))
        for i in range(len(stack[0]))
    ]


levels_of = st.lists(st.integers(1, 4), min_size=1, max_size=4)


@settings(steady, max_examples=150)
@given(seeds, levels_of, st.integers(2, 8))
def test_tasks_in_order_agree_with_nested_null_spaces(seed, shapes, n):
    stack = stacks(seed, shapes, n)
    qd, P = solve_priorities(batch(stack), RCOND)
    for b, levels in enumerate(stack):
        expected, left = lexicographic(levels)
        scale = 1 + np.linalg.norm(expected)
        close(qd[:, b], expected, 1e-9 * scale**2)
        close(P[..., b], left, 1e-9 * scale)
        is_projector(P[..., b], 1e-12)


@settings(steady, max_examples=150)
@given(seeds, st.lists(st.integers(1, 4), min_size=3, max_size=4), st.integers(2, 8))
def test_a_lower_level_never_disturbs_a_higher_one(seed, shapes, n):
    stack = stacks(seed, shapes, n)
    levels = batch(stack)
    served = [solve_priorities(levels[: i + 1], RCOND)[0] for i in range(len(levels))]
    qd, P = solve_priorities(levels, RCOND)
    speed = 1 + np.abs(qd).max(axis=0)
    for (A, _), before in zip(levels, served, strict=True):
        size = 1 + np.abs(A).max()
        close(np.einsum("knb,nb->kb", A, qd - before) / speed, 0, 1e-10 * size)
        close(np.einsum("knb,nmb->kmb", A, P), 0, RCOND * 10 * size)  # what counts as zero


@pytest.mark.parametrize("gap", 10.0 ** -np.arange(0, 18))
def test_levels_that_nearly_conflict_are_served_or_dropped_but_never_disturb(gap):
    rng = np.random.default_rng(4)
    first = np.linalg.qr(rng.normal(size=(6, 3)))[0].T
    second = first[:1] + gap * np.linalg.qr(rng.normal(size=(6, 1)))[0].T
    levels = [(first, np.ones(3)), (second, -np.ones(1)), (rng.normal(size=(2, 6)), np.ones(2))]
    qd, P = solve_priorities(batch([levels]), RCOND)
    close(first @ qd[:, 0], 1, 1e-10 if gap < 1e-2 else 1e-12)
    assert np.abs(second @ qd[:, 0] + 1).max() < 1e-9 or gap < 2e-6
    assert np.linalg.norm(qd) < 1e2 / max(gap, RCOND)
    assert np.trace(P[..., 0]) == pytest.approx(0 if gap > 2e-6 else 1, abs=1e-9)


def test_a_level_that_repeats_another_changes_nothing():
    rng = np.random.default_rng(5)
    A, rate = rng.normal(size=(3, 6, 4)), rng.normal(size=(3, 4))
    once, P = solve_priorities([(A, rate)], RCOND)
    twice, Q = solve_priorities([(A, rate), (2 * A, -rate), (np.zeros((1, 6, 4)), rate[:1])], RCOND)
    np.testing.assert_array_equal(twice, once)
    np.testing.assert_array_equal(Q, P)


def test_one_level_is_least_squares_and_its_projector_the_null_space():
    rng = np.random.default_rng(6)
    A, rate = rng.normal(size=(8, 6, 4)), rng.normal(size=(8, 4))
    A[:, 5] = A[:, 0]
    qd, P = solve_priorities([(A, rate)], RCOND)
    for b in range(4):
        close(qd[:, b], np.linalg.pinv(A[..., b], rcond=RCOND) @ rate[:, b], 1e-13)
    np.testing.assert_array_equal(P, null_space(A, RCOND))


# tasks of one camera, which all act through its Jacobian


def multiply(levels, J):
    """The levels (L J, rate) of levels (L, rate)."""
    return [(np.einsum("kmb,mnb->knb", L, J), rate) for L, rate in levels]


def solve_by_camera(levels, J):
    """The velocities and the projector of levels (L, rate) with A = L J."""

    def add(program, J, *rows):
        pairs = list(zip(rows[::2], rows[1::2], strict=True))
        qd, free_motions = add_camera_priorities(RowSpace.of(program, J), pairs, RCOND)
        return qd, free_motions.add_projector()

    found = evaluate_stages(add, [J, *(array for level in levels for array in level)])
    return found, multiply(levels, J)


def camera_jacobian(rng, n):
    """A random Jacobian: of full rank, lacking rank, or with a row of zeros."""
    kind = rng.integers(4)
    J = of_rank(rng, 6, n, 6 if kind else int(rng.integers(0, 6)))
    J[rng.integers(6)] *= kind != 1
    return J


@settings(steady, max_examples=50)
@given(seeds, st.lists(st.integers(1, 9), min_size=1, max_size=3), st.integers(7, 12))
def test_tasks_of_one_camera_agree_with_nested_null_spaces(seed, shapes, n):
    rng, stack = np.random.default_rng(seed), stacks(seed, shapes, 6)
    J = last(*(camera_jacobian(rng, n) for _ in stack))
    (qd, P), products = solve_by_camera(batch(stack), J)
    for b in range(len(stack)):
        expected, left = lexicographic([(A[..., b], rate[:, b]) for A, rate in products])
        scale = 1 + np.linalg.norm(expected)
        close(qd[:, b], expected, 1e-9 * scale**2)
        close(P[..., b], left, 1e-9 * scale)
        is_projector(P[..., b], 1e-12)


@pytest.mark.parametrize("n", [7, 9, 20])
def test_four_points_and_a_redundant_arm_leave_the_null_space_of_its_jacobian(n):
    rng = np.random.default_rng(n)
    L, rate, J = rng.normal(size=(8, 6, 5)), rng.normal(size=(8, 5)), rng.normal(size=(6, n, 5))
    (qd, P), _ = solve_by_camera([(L, rate)], J)
    for b in range(5):
        pinv = np.linalg.pinv(J[..., b])
        close(P[..., b], np.eye(n) - pinv @ J[..., b], 1e-13)
        close(qd[:, b], pinv @ np.linalg.pinv(L[..., b]) @ rate[:, b], 1e-12)


@steady
@given(seeds, st.lists(st.integers(1, 9), max_size=3), st.integers(7, 12), st.booleans())
def test_a_free_motion_is_the_product_with_the_projector_in_any_batch(seed, shapes, n, by_camera):
    rng, stack = np.random.default_rng(seed), stacks(seed, [2, *shapes], 6)
    J = last(*(camera_jacobian(rng, n) for _ in stack))
    levels = batch(stack) if by_camera else multiply(batch(stack), J)
    motion, qd = rng.normal(size=(2, n, len(stack)))

    def add(program, J, motion, qd, *rows):
        pairs = list(zip(rows[::2], rows[1::2], strict=True))
        if by_camera:
            _, free_motions = add_camera_priorities(RowSpace.of(program, J), pairs, RCOND)
        else:
            _, free_motions = add_priorities(program, pairs, RCOND)
        return free_motions.add_motion(motion, qd), free_motions.add_projector()

    arrays = [J, motion, qd, *(array for level in levels for array in level)]
    whole, P = evaluate_stages(add, arrays)
    close(whole, qd + np.einsum("nmb,mb->nb", P, motion), 1e-13)
    for b in range(len(stack)):
        alone, _ = evaluate_stages(add, [np.ascontiguousarray(a[..., b : b + 1]) for a in arrays])
        np.testing.assert_array_equal(alone[:, 0], whole[:, b])


@steady
@given(seeds, st.integers(1, 12), st.integers(3, 12), st.booleans())
def test_the_free_motions_of_a_task_are_its_null_space_also_after_its_law(seed, k, n, solves):
    rng = np.random.default_rng(seed)
    J = last(*(camera_jacobian(rng, n) for _ in range(4)))
    L = last(*(of_rank(rng, k, 6, int(rng.integers(1, 7))) for _ in range(4)))
    motion, qd, y = rng.normal(size=(n, 4)), rng.normal(size=(n, 4)), rng.normal(size=(k, 4))
    ((A, _),) = multiply([(L, y)], J)

    def add(program, L, J, A, y, motion, qd):
        product = TaskProduct(program, L, J, A)
        if solves and min(k, n) > 6:
            product.solve(y, RCOND)
        free_motions = product.find_free_motions(RCOND)
        return free_motions.add_motion(motion, qd), free_motions.add_projector()

    found, P = evaluate_stages(add, [L, J, A, y, motion, qd])
    for b in range(4):
        expected = np.eye(n) - np.linalg.pinv(A[..., b], rcond=RCOND) @ A[..., b]
        close(P[..., b], expected, 1e-9)
        is_projector(P[..., b], 1e-12)
        close(found[:, b], qd[:, b] + P[..., b] @ motion[:, b], 1e-13)


@pytest.mark.parametrize("least", 10.0 ** -np.arange(0, 18))
def test_a_camera_that_hardly_moves_in_one_direction_changes_no_result(least):
    rng = np.random.default_rng(11)
    U, V = np.linalg.qr(rng.normal(size=(6, 6)))[0], np.linalg.qr(rng.normal(size=(7, 7)))[0]
    J = ((U * [1, 1, 1, 1, 1, least]) @ V[:6])[..., None]
    levels = [
        (rng.normal(size=(2, 6, 1)), np.ones((2, 1))),
        (np.eye(6)[..., None], np.ones((6, 1))),
    ]
    (qd, P), products = solve_by_camera(levels, J)
    expected, left = solve_priorities(products, RCOND)
    lost = least < RCOND  # the direction counts as lost
    close(qd, expected, 1e-12 if lost else 1e-13 / least**2)
    close(P, left, 1e-12 if lost else 1e-13 / least)


# every run on its own


def test_a_run_does_not_depend_on_its_batch_by_a_single_bit():
    levels = batch(stacks(7, (3, 2, 2), 6, 23))
    A, rate = levels[0]
    whole = *solve_priorities(levels, RCOND), large(A, rate, 0.5, 2.0)
    for part in (slice(0, 1), slice(3, 20), slice(22, 0, -5)):
        some = [
            (np.ascontiguousarray(A[..., part]), np.ascontiguousarray(r[..., part]))
            for A, r in levels
        ]
        again = *solve_priorities(some, RCOND), large(*some[0], 0.5, 2.0)
        for a, b in zip(again, whole, strict=True):
            np.testing.assert_array_equal(a, b[..., part])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_run_that_is_not_finite_stays_so_and_leaves_the_others_alone(bad):
    levels = batch(stacks(8, (3, 2, 2), 6, 9))
    qd, P = solve_priorities(levels, RCOND)
    clean = large(*levels[0], 0.5, 2.0)
    levels[1][0][0, 2, 4] = levels[0][0][2, 1, 7] = bad
    spoilt, Q = solve_priorities(levels, RCOND)
    spoilt_large = large(*levels[0], 0.5, 2.0)
    others = np.setdiff1d(np.arange(9), [4, 7])
    assert np.isnan(spoilt[:, [4, 7]]).all() and np.isnan(Q[..., [4, 7]]).all()
    assert np.isnan(spoilt_large[..., 7]).any()
    np.testing.assert_array_equal(spoilt[:, others], qd[:, others])
    np.testing.assert_array_equal(Q[..., others], P[..., others])
    np.testing.assert_array_equal(spoilt_large[..., others], clean[..., others])


def test_the_arguments_are_not_changed():
    levels = batch(stacks(9, (3, 2), 6))
    before = copy.deepcopy(levels)
    P = null_space(levels[0][0], RCOND)
    kept = P.copy()
    solve_priorities(levels, RCOND)
    large_projection(*levels[0], 0.0, 1e-9, P)
    np.testing.assert_array_equal(P, kept)
    for (A, r), (B, s) in zip(levels, before, strict=True):
        np.testing.assert_array_equal(A, B)
        np.testing.assert_array_equal(r, s)


# secondary motions


def test_near_its_limit_a_coordinate_moves_back_in_proportion():
    limits = np.array([[-1.0, 3.0]] * 6)
    q = np.array([[-1.0], [-0.8], [-0.6], [1.0], [2.7], [3.5]])
    wish = AvoidLimits(gain=2.0, margin=0.1).velocity(q.T, limits)
    close(wish[0], [0.8, 0.4, 0.0, 0.0, -0.2, -1.8], 1e-15)


def test_it_descends_the_published_cost():
    rng = np.random.default_rng(10)
    limits = np.sort(rng.uniform(-3, 3, (6, 2)))
    span = np.diff(limits)
    q = limits[:, :1] + rng.uniform(-0.1, 1.1, (6, 50)) * span

    def cost(q):
        least, most = limits[:, :1] + 0.2 * span, limits[:, 1:] - 0.2 * span
        s = np.where(q > most, q - most, np.where(q < least, q - least, 0.0))
        return s**2 / (2 * span)

    h = 1e-6
    gradient = (cost(q + h) - cost(q - h)) / (2 * h)
    close(AvoidLimits(gain=1.5, margin=0.2).velocity(q.T, limits).T, -1.5 * gradient * span, 1e-8)


def test_a_coordinate_without_both_limits_is_left_alone():
    inf = np.inf
    limits = np.array([[-inf, inf], [-1.0, inf], [-inf, 1.0], [0.5, 0.5]])
    q = np.array([[1e9, -5.0], [-2.0, 9.0], [9.0, -2.0], [0.5, 0.7]])
    wish = AvoidLimits().velocity(q.T, limits).T
    np.testing.assert_array_equal(wish[:3], 0)
    close(wish[3], [0, -0.2], 1e-15)


def test_a_posture_draws_every_coordinate():
    q = np.random.default_rng(11).normal(size=(3, 5))
    wish = Posture([0.1, 0.2, 0.3], gain=2.0).velocity(q.T, np.zeros((3, 2)))
    close(wish.T, -2 * (q - [[0.1], [0.2], [0.3]]), 1e-15)


def test_secondary_motions_are_values():
    for value in (AvoidLimits(2.0, 0.2), Posture([0.1, 0.2], 2.0)):
        assert isinstance(value, SecondaryMotion)
        for again in (copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
            assert again == value and hash(again) == hash(value)
    assert Posture([0.1, 0.2]) != Posture([0.1, 0.3])
    assert not Posture([0.1]).q.flags.writeable


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: AvoidLimits(gain=0), "gain must be a positive number .per second."),
        (lambda: AvoidLimits(margin=0.5), "margin must be a number above 0 and below 0.5, got 0.5"),
        (lambda: AvoidLimits(margin=-0.1), "margin must be a number above 0"),
        (lambda: Posture("home"), "Posture.q: expected numbers"),
        (lambda: Posture([]), r"q must be one number for each joint, got \[\]"),
        (lambda: Posture([[1.0]]), r"q must be one number for each joint, got \[\[1.0\]\]"),
        (lambda: Posture([1.0, np.nan]), r"Posture.q: nan at index \(1,\)"),
        (lambda: Posture([1.0], gain=None), "Posture.gain: expected a number, got None"),
        (lambda: Posture([1.0]).check(["a", "b"]), "1 coordinates for 2 commanded ones: a, b"),
    ],
)
def test_an_invalid_secondary_motion_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
    Posture([1.0, 2.0]).check(["a", "b"])
