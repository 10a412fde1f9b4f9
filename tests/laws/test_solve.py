"""Least squares of many small systems at once, against LAPACK, and run by run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.kernels.linear_algebra import pseudoinverse, svd
from robsim.kernels.machine.program import evaluate_stages
from robsim.servo.task_product import TaskProduct

steady = settings(derandomize=True, max_examples=30, deadline=None)
seeds, sizes = st.integers(0, 2**32), st.integers(1, 9)
SHAPES = [(8, 6), (20, 6), (6, 6), (6, 5), (5, 6), (3, 6), (6, 1), (1, 6), (1, 1)]
EPS = np.finfo(float).eps


def least_squares(A, y, damping=0.0, rcond=1e-12):
    """x (n, runs) and rank (runs,) of A (m, n, runs) and y (m, runs)."""
    x, rank = np.empty(A.shape[1:]), np.empty(A.shape[2], dtype=np.int64)
    pseudoinverse.least_squares(
        np.ascontiguousarray(A), np.ascontiguousarray(y), damping, rcond, x, rank
    )
    return x, rank


def one(A, y, **how):
    x, rank = least_squares(A[..., None], y[:, None], **how)
    return x[:, 0], rank[0]


def with_singular_values(rng, shape, sigma):
    """A = U sigma V', and V: a matrix with known singular values."""
    k = min(shape)
    U, _ = np.linalg.qr(rng.normal(size=(shape[0], k)))
    V, _ = np.linalg.qr(rng.normal(size=(shape[1], k)))
    return U * np.asarray(sigma) @ V.T, V


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


# full rank


@steady
@given(seeds, sizes, sizes)
def test_tall_square_and_wide_systems_agree_with_lapack(seed, m, n):
    rng = np.random.default_rng(seed)
    A, _ = with_singular_values(rng, (m, n), rng.uniform(0.1, 10, min(m, n)))
    y = rng.normal(size=m)
    x, rank = one(A, y)
    close(x, np.linalg.lstsq(A, y, rcond=None)[0], 1e-12)
    assert rank == min(m, n)


@steady
@given(seeds, sizes, sizes)
def test_the_residual_is_normal_to_the_columns_and_the_solution_lies_in_the_rows(seed, m, n):
    """The conditions of the least-squares solution x of least norm, without another solver."""
    rng = np.random.default_rng(seed)
    A, V = with_singular_values(rng, (m, n), rng.uniform(0.1, 10, min(m, n)))
    y = rng.normal(size=m)
    x, _ = one(A, y)
    close(A.T @ (A @ x - y), 0, 1e-12)
    close(x - V @ (V.T @ x), 0, 1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("condition", [1e0, 1e3, 1e6, 1e9, 1e12])
@pytest.mark.parametrize("rcond", [1e-15, 2e-13], ids=["by_qr", "near_the_threshold"])
def test_the_error_grows_no_faster_than_the_condition_number(shape, condition, rcond):
    rng = np.random.default_rng(5)
    sigma = np.geomspace(1, 1 / condition, min(shape)) if min(shape) > 1 else [1.0]
    for _ in range(5):
        A, V = with_singular_values(rng, shape, sigma)
        expected = V @ rng.normal(size=min(shape))
        x, rank = one(A, A @ expected, rcond=rcond)
        assert rank == min(shape)
        assert np.linalg.norm(x - expected) <= 5 * EPS * condition * np.linalg.norm(expected)


@steady
@given(seeds, st.sampled_from([1e-100, 1e-9, 1e9, 1e100]))
def test_the_unit_of_the_matrix_only_divides_the_solution(seed, unit):
    rng = np.random.default_rng(seed)
    A, y = rng.normal(size=(8, 6)), rng.normal(size=8)
    np.testing.assert_allclose(one(unit * A, y)[0] * unit, one(A, y)[0], rtol=1e-9, atol=1e-12)


# rank deficiency


@pytest.mark.parametrize("shape", [(8, 6), (6, 6), (6, 5), (5, 6)])
@pytest.mark.parametrize("rank", [0, 1, 3, 4])
def test_a_matrix_without_full_rank_gets_its_pseudo_inverse(shape, rank):
    rng = np.random.default_rng(6)
    sigma = np.append(np.geomspace(2, 0.5, rank), np.zeros(min(shape) - rank))
    A, _ = with_singular_values(rng, shape, sigma)
    y = rng.normal(size=shape[0])
    x, found = one(A, y, rcond=1e-8)
    close(x, np.linalg.pinv(A, rcond=1e-8) @ y, 1e-13)
    assert found == rank == np.linalg.matrix_rank(A, tol=1e-8)


@pytest.mark.parametrize("shape", [(8, 6), (6, 6), (4, 6)])
def test_singular_values_are_truncated_below_rcond_times_the_largest(shape):
    rng, k = np.random.default_rng(7), min(shape)
    sigma = 3.0 * 10.0 ** -np.arange(k)  # 3, 0.3, 0.03, ...
    A, _ = with_singular_values(rng, shape, sigma)
    y = rng.normal(size=shape[0])
    for kept in range(1, k + 1):
        rcond = 0.5 * 10.0 ** -(kept - 1)
        x, rank = one(A, y, rcond=rcond)
        assert rank == kept
        expected = np.linalg.pinv(A, rcond=rcond) @ y
        assert np.linalg.norm(x - expected) <= 1e-11 * np.linalg.norm(expected)


@pytest.mark.parametrize("shape", SHAPES)
def test_nothing_maps_to_nothing(shape):
    for damping in (0.0, 0.1):
        x, rank = one(np.zeros(shape), np.ones(shape[0]), damping=damping)
        close(x, 0, 0)
        assert rank == (0 if damping == 0.0 else min(shape))
    close(one(np.ones(shape), np.zeros(shape[0]))[0], 0, 0)


def test_columns_and_rows_that_repeat_share_the_solution():
    rng = np.random.default_rng(8)
    A, y = rng.normal(size=(8, 6)), rng.normal(size=8)
    A[:, 4] = A[:, 1]
    x, rank = one(A, y)
    assert rank == 5
    assert x[4] == pytest.approx(x[1], rel=1e-12)
    B, z = rng.normal(size=(5, 6)), rng.normal(size=5)
    B[3], z[3] = B[0], z[0]
    x, rank = one(B, z)
    assert rank == 4
    close(B @ x, z, 1e-12)


def decomposed(A):
    """G (m, k, runs), V (k, k, runs) and sigma (k, runs) of A (m, n, runs)."""
    m, n, runs = A.shape
    k = min(m, n)
    G, V, sigma = np.empty((max(m, n), k, runs)), np.empty((k, k, runs)), np.empty((k, runs))
    svd.decompose_matrices(np.ascontiguousarray(A), G, V, sigma)
    return G, V, sigma


@steady
@given(seeds, sizes, sizes)
def test_singular_values_agree_with_lapack(seed, m, n):
    A = np.random.default_rng(seed).normal(size=(m, n))
    G, V, sigma = (part[..., 0] for part in decomposed(A[..., None]))
    close(np.sort(sigma)[::-1], np.linalg.svd(A, compute_uv=False), 1e-14 * (1 + sigma.max()))
    close(G @ V.T, A if m >= n else A.T, 1e-14 * (1 + sigma.max()))
    close(V.T @ V, np.eye(min(m, n)), 1e-14)


def test_singular_values_of_a_run_do_not_depend_on_those_beside_it():
    """Easy ones, which need no rotation, beside hard ones, zeros and one that is not finite."""
    rng = np.random.default_rng(2)
    A = rng.normal(size=(8, 7, 6))
    A[:, :, 1] = np.eye(8, 7)
    A[:, :, 2], A[:, 3, 3], A[0, 0, 4] = 0.0, A[:, 2, 3], np.nan
    together = decomposed(A)
    for b in range(6):
        for whole, alone in zip(together, decomposed(A[..., b : b + 1]), strict=True):
            assert whole[..., b].tobytes() == alone[..., 0].tobytes()


# products


def of_product(B, C, y, rcond=1e-9):
    A = np.einsum("irb,rjb->ijb", B, C)
    n = A.shape[1]

    def add(program, B, C, A, y):
        product = TaskProduct(program, B, C, A)
        return product.solve(y, rcond), product.rank

    x, rank = evaluate_stages(add, [B, C, A, y], [(n,), ()])
    return A, x, rank


@steady
@given(seeds, st.integers(6, 16), st.integers(6, 10))
def test_a_product_of_full_factors_is_inverted_as_lapack_does(seed, m, n):
    rng = np.random.default_rng(seed)
    B, C, y = (rng.normal(size=(*shape, 3)) for shape in ((m, 6), (6, n), (m,)))
    A, x, rank = of_product(B, C, y)
    assert (rank == 6).all()
    for b in range(3):
        size = np.linalg.cond(B[..., b]) * np.linalg.cond(C[..., b])
        expected = np.linalg.pinv(A[..., b], rcond=1e-12) @ y[:, b]
        close(x[:, b], expected, 20 * EPS * size**2 * (1 + np.abs(expected).max()))


def test_a_product_of_factors_that_are_not_full_is_truncated():
    rng = np.random.default_rng(4)
    B, C, y = rng.normal(size=(8, 6, 4)), rng.normal(size=(6, 7, 4)), rng.normal(size=(8, 4))
    B[:, 5, 0] = B[:, 0, 0]
    C[2, :, 1] = 3.0 * C[4, :, 1]
    C[0, 0, 2] = np.nan
    A, x, rank = of_product(B, C, y)
    assert rank[[0, 1, 3]].tolist() == [5, 5, 6] and np.isnan(x[:, 2]).all()
    for b in (0, 1, 3):
        close(x[:, b], np.linalg.pinv(A[..., b], rcond=1e-9) @ y[:, b], 1e-12)
    alone = of_product(*(np.ascontiguousarray(part[..., 1:2]) for part in (B, C, y)))[1]
    assert alone[:, 0].tobytes() == np.ascontiguousarray(x[:, 1]).tobytes()


# damping


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("damping", [1e-3, 0.1, 10.0])
def test_damping_is_least_squares_with_the_identity_below(shape, damping):
    rng = np.random.default_rng(9)
    for _ in range(5):
        A, y = rng.normal(size=shape), rng.normal(size=shape[0])
        A[:, -1] = A[:, 0]
        below = np.vstack([A, damping * np.eye(shape[1])])
        expected = np.linalg.lstsq(below, np.append(y, np.zeros(shape[1])), rcond=None)[0]
        condition = np.linalg.norm(A) / damping  # its square enters with the residual
        close(one(A, y, damping=damping)[0], expected, EPS * (500 + condition**2))


def test_a_damped_solution_is_shorter_and_tends_to_the_exact_one():
    rng = np.random.default_rng(10)
    A, y = rng.normal(size=(8, 6)), rng.normal(size=8)
    exact, _ = one(A, y)
    dampings = np.array([1e-1, 1e-2, 1e-3])
    damped = [one(A, y, damping=d)[0] for d in dampings]
    assert (np.diff([np.linalg.norm(x) for x in (*damped, exact)]) > 0).all()
    errors = [np.linalg.norm(x - exact) for x in damped]
    assert (np.diff(np.log(errors)) / np.diff(np.log(dampings)) >= 1.8).all()  # of order 2


def test_damping_keeps_a_solution_bounded_by_half_the_data_over_the_damping():
    rng = np.random.default_rng(11)
    for sigma in 10.0 ** -np.arange(0, 16):
        A, _ = with_singular_values(rng, (6, 6), [1, 1, 1, 1, 1, sigma])
        y = rng.normal(size=6)
        x, _ = one(A, y, damping=0.05)
        assert np.linalg.norm(x) <= np.linalg.norm(y) / (2 * 0.05) * (1 + 1e-12)


# every run on its own


def batch(shape, runs=23):
    """Well conditioned runs, and among them some that need their singular values."""
    rng = np.random.default_rng(12)
    A, y = rng.normal(size=(*shape, runs)), rng.normal(size=(shape[0], runs))
    A[:, -1, ::3] = A[:, 0, ::3]
    A[..., 5] = 0.0
    return A, y


@pytest.mark.parametrize("shape", [(8, 6), (6, 6), (5, 6), (6, 5)])
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_run_does_not_depend_on_its_neighbours_by_a_single_bit(shape, damping):
    A, y = batch(shape)
    x, rank = least_squares(A, y, damping)
    for b in range(23):
        alone, r = one(A[..., b], y[:, b], damping=damping)
        np.testing.assert_array_equal(x[:, b], alone)
        assert rank[b] == r
    for part in (slice(0, 2), slice(3, 20), slice(22, 0, -5)):
        again, _ = least_squares(A[..., part], y[:, part], damping)
        np.testing.assert_array_equal(again, x[:, part])


@pytest.mark.parametrize("shape", [(8, 6), (6, 6), (5, 6)])
@pytest.mark.parametrize("damping", [0.0, 0.1])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["matrix", "data"])
def test_a_run_that_is_not_finite_stays_so_and_leaves_the_others_alone(shape, damping, bad, where):
    A, y = batch(shape)
    clean, _ = least_squares(A, y, damping)
    spoilt = [4, 6, 11]  # 6 needs its singular values
    if where == "matrix":
        A[2, 3, spoilt] = bad
    else:
        y[2, spoilt] = bad
    x, _ = least_squares(A, y, damping)
    others = np.setdiff1d(np.arange(23), spoilt)
    np.testing.assert_array_equal(x[:, others], clean[:, others])
    assert (~np.isfinite(x[:, spoilt])).any(axis=0).all()


def test_the_data_are_left_as_they_were():
    A, y = batch((8, 6))
    before = A.copy(), y.copy()
    least_squares(A, y)
    least_squares(A, y, 0.1)
    np.testing.assert_array_equal(A, before[0])
    np.testing.assert_array_equal(y, before[1])


@steady
@given(seeds, sizes, sizes, sizes)
def test_products_agree_with_numpy_run_by_run(seed, m, k, n):
    rng = np.random.default_rng(seed)
    A, B, out = rng.normal(size=(m, k, 4)), rng.normal(size=(k, n, 4)), np.empty((m, n, 4))
    pseudoinverse.multiply_matrices(A, B, out)
    close(out, np.einsum("mkb,knb->mnb", A, B), 1e-14 * k)
