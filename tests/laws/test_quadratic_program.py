"""Quadratic programs against closed forms and exact conditions; the stage of a command."""

import numpy as np
import pytest
from quadratic_problems import (
    certificate_error,
    constrain,
    kkt_errors,
    make_problem,
    solve,
    violation,
)

from robsim.kernels.control.constrained_command import (
    CONSTRAINED,
    RELAXED_ALL,
    RELAXED_SPACE,
    RELAXED_VIEW,
    UNCHANGED,
    UNSOLVED,
)
from robsim.kernels.control.quadratic_program import INFEASIBLE, SOLVED

FREE = np.full(3, -np.inf), np.full(3, np.inf)
NO_ROWS = np.zeros((0, 3)), np.zeros(0)


@pytest.mark.full
def test_a_wish_that_satisfies_all_constraints_keeps_its_bits():
    rng = np.random.default_rng(1)
    wish, C = rng.normal(size=3), rng.normal(size=(9, 3))
    H = np.full((3, 3), np.nan)  # no factorisation
    state, x, y = solve(H, wish, wish, wish, C, C @ wish - 1e-3)
    assert state == SOLVED and (x == wish).all() and not y.any()


def test_a_single_row_projects_along_the_metric():
    H, wish, c = np.diag([1.0, 2.0, 4.0]), np.array([1.0, 2.0, 3.0]), np.array([3.0, -1.0, 2.0])
    state, x, y = solve(H, wish, *FREE, c[None], np.array([10.0]))
    price = (10.0 - c @ wish) / (c @ np.linalg.solve(H, c))
    assert state == SOLVED
    np.testing.assert_allclose(x, wish + price * np.linalg.solve(H, c), rtol=1e-14)
    np.testing.assert_allclose(y, [*np.zeros(6), price], rtol=1e-14)


def test_bounds_of_a_diagonal_metric_clip_and_reach_the_bound_bit_for_bit():
    wish, low, high = np.array([-2.0, 0.3, 5.0]), np.full(3, -0.1), np.full(3, 0.7)
    state, x, y = solve(np.diag([1.0, 2.0, 4.0]), wish, low, high, *NO_ROWS)
    assert state == SOLVED and (x == np.clip(wish, low, high)).all()
    np.testing.assert_allclose(y, [1.9, 0, 0, 0, 0, 17.2], atol=1e-14)


def test_equal_and_opposite_rows_and_duplicates_define_a_plane():
    c = np.array([1.0, 2.0, 2.0]) / 3.0
    C, bound = np.array([c, -c, c, 5.0 * c, -0.1 * c]), np.array([2.0, -2.0, 2.0, 10.0, -0.2])
    state, x, _ = solve(np.eye(3), np.zeros(3), *FREE, C, bound)
    assert state == SOLVED
    np.testing.assert_allclose(x, 2.0 * c, atol=1e-15)


def test_many_rows_through_one_vertex():
    rng = np.random.default_rng(2)
    C = rng.normal(size=(60, 3))
    C[:, 2] = abs(C[:, 2]) + 2.0
    vertex = np.array([0.5, -0.25, 1.0])
    state, x, y = solve(np.eye(3), vertex - [0, 0, 3.0], *FREE, C, C @ vertex)
    assert state == SOLVED and violation(*FREE, C, C @ vertex, x) < 1e-12
    assert max(kkt_errors(np.eye(3), vertex - [0, 0, 3.0], *FREE, C, C @ vertex, x, y)) < 1e-12


def test_rows_of_zeros():
    hidden = np.zeros((2, 3)), np.array([-np.inf, -1.0])
    state, x, _ = solve(np.eye(3), np.ones(3), *FREE, *hidden)
    assert state == SOLVED and (x == 1.0).all()
    state, _, y = solve(np.eye(3), np.ones(3), *FREE, np.zeros((2, 3)), np.array([-np.inf, 0.1]))
    assert state == INFEASIBLE and y.tolist() == [0, 0, 0, 0, 0, 0, 0, 1]


def test_a_certificate_names_the_constraints_that_contradict_one_another():
    C, bound = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([3.0, -9.0])
    low, high = np.full(3, -5.0), np.array([1.0, 1.0, 5.0])
    state, x, y = solve(np.eye(3), np.zeros(3), low, high, C, bound)
    assert state == INFEASIBLE and np.flatnonzero(y).tolist() == [3, 4, 6]
    assert certificate_error(low, high, C, bound, y) < 1e-15
    assert (x >= low).all() and (x <= high).all()


@pytest.mark.parametrize("seed", range(4))
def test_random_programs_satisfy_their_conditions(seed):
    rng, states = np.random.default_rng([33, seed]), []
    for _ in range(250):
        problem = make_problem(rng)
        state, x, y = solve(*problem)
        states.append(state)
        if state == SOLVED:
            assert violation(*problem[2:], x) < 1e-9 and y.min() >= 0.0
            assert (x >= problem[2]).all() and (x <= problem[3]).all()
            assert max(kkt_errors(*problem, x, y)) < 1e-9
        else:
            assert state == INFEASIBLE and certificate_error(*problem[2:], y) < 1e-7
    assert 30 < sum(each == INFEASIBLE for each in states) < 100


def draw_runs(runs=1000, n=7, m=24):
    rng = np.random.default_rng(5)
    C = rng.normal(size=(runs, m, n))
    inner = rng.uniform(-0.5, 0.5, (runs, n))
    excess = rng.choice([-1.0, 0.0, 0.5, 1.0, 6.0], (runs, 1))
    bound = np.einsum("bmn,bn->bm", C, inner) + rng.uniform(-2.0, excess, (runs, m))
    wish = rng.normal(size=(runs, n)) * rng.choice([0.1, 1.5], (runs, 1))
    A, box = rng.normal(size=(runs, 8, n)), np.ones((runs, n))
    return A, wish, -box, box, C, bound


LEVELS = np.arange(24) % 3
KEPT = {UNCHANGED: 3, CONSTRAINED: 3, RELAXED_VIEW: 2, RELAXED_SPACE: 1, RELAXED_ALL: 0}


def test_bits_of_the_stage_do_not_depend_on_neighbours():
    arrays = draw_runs()
    together = constrain(*arrays, LEVELS)
    codes, counts = np.unique(together["unmet"], return_counts=True)
    assert codes.tolist() == [UNCHANGED, CONSTRAINED, RELAXED_VIEW, RELAXED_SPACE, RELAXED_ALL]
    assert counts.min() > 10
    for at in 0, 1, 17, 500, 999:
        alone = constrain(*(each[at : at + 1] for each in arrays), LEVELS)
        for name, values in alone.items():
            assert values.tobytes() == together[name][at : at + 1].tobytes(), name


def test_commands_of_the_stage_satisfy_the_conditions_of_their_program():
    A, wish, low, high, C, bound = draw_runs(200)
    found = constrain(A, wish, low, high, C, bound, LEVELS)
    for i in range(200):
        qd, slack = found["qd"][i], found["slack"][i]
        excess = bound[i] - C[i] @ qd
        assert (low[i] <= qd).all() and (qd <= high[i]).all()
        code = found["unmet"][i]
        kept = KEPT[code] > LEVELS
        assert (excess[kept] < 1e-8).all() and not slack[kept].any()
        np.testing.assert_allclose(slack[~kept], np.maximum(excess[~kept], 0.0), atol=1e-8)
        if code == CONSTRAINED:
            H = A[i].T @ A[i]
            H = H * 7 / np.trace(H) + 1e-6 * np.eye(7)
            y = found["multipliers"][i].copy()
            y[14:] /= np.linalg.norm(C[i], axis=1)  # those of rows of unit length
            assert max(kkt_errors(H, wish[i], low[i], high[i], C[i], bound[i], qd, y)) < 1e-9


def constrain_one(wish, low, high, C=(), bound=(), levels=(), **options):
    C = np.reshape(C, (-1, 2))
    arrays = (np.array(each, dtype=float)[None] for each in (np.eye(2), wish, low, high, C, bound))
    found = constrain(*arrays, np.array(levels, dtype=float), **options)
    return {name: values[0] for name, values in found.items()}


def test_rows_of_the_highest_level_yield_to_the_same_extent():
    C, bound = [[1, 0], [-2, 0], [0, 1]], [1, 0, 0.5]
    found = constrain_one([0.2, 0.0], [-2, -2], [2, 2], C, bound, [2, 2, 1], price=1e9)
    assert found["unmet"] == RELAXED_VIEW
    np.testing.assert_allclose(found["qd"], [0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(found["slack"], [0.5, 1.0, 0.0], atol=1e-6)


def test_hard_rows_yield_last_and_bounds_never():
    hard = constrain_one([0.0, 0.0], [-1, -1], [1, 1], [[1, 0]], [3], [0])
    assert hard["unmet"] == RELAXED_ALL
    np.testing.assert_allclose(hard["qd"], [1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(hard["slack"], [2.0])
    wrong = constrain_one([0.5, 0.0], [1, 1], [-1, -1], [[1, 0]], [3], [2])
    assert wrong["unmet"] == UNSOLVED and np.isfinite(wrong["qd"]).all()


def test_a_fixed_velocity_stays_and_the_others_follow_the_metric():
    found = constrain_one([0.5, 0.25], [0, -1], [0, 1])
    assert found["unmet"] == CONSTRAINED and found["qd"].tolist() == [0.0, 0.25]
    assert constrain_one([0.5, 0.25], [-1, -1], [1, 1])["unmet"] == UNCHANGED


@pytest.mark.parametrize(
    ("wish", "bound"), [((np.nan, 0), -1), ((np.inf, 0), -1), ((0, 0), np.nan), ((0, 0), np.inf)]
)
def test_numbers_that_are_not_finite_give_no_command(wish, bound):
    found = constrain_one(wish, [-1, -1], [1, 1], [[1.0, 1.0]], [bound], [2])
    assert np.isnan(found["qd"]).all() and found["unmet"] == UNSOLVED
