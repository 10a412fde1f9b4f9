"""Quadratic programs beside daqp, and beside a linear program where daqp finds no solution."""

import os

import daqp
import numpy as np
import pytest
from quadratic_problems import (
    MOST_ROWS,
    MOST_UNKNOWNS,
    certificate_error,
    kkt_errors,
    make_problem,
    solve,
    violation,
)
from scipy.optimize import linprog

from robsim.kernels.control.quadratic_program import INFEASIBLE, SOLVED

COUNT = int(os.environ.get("ROBSIM_QUADRATIC_PROGRAMS", "8000"))
FAR = 1e30  # infinity of daqp


def solve_by_daqp(H, wish, low, high, C, bound):
    """Solution by daqp, or None."""
    upper = np.concatenate([np.minimum(high, FAR), np.full(len(bound), FAR)])
    lower = np.maximum(np.concatenate([low, bound]), -FAR)
    kinds = np.zeros(len(upper), dtype=np.int32)
    x, _, flag, _ = daqp.solve(H, -H @ wish, C.copy(), upper, lower, kinds, primal_tol=1e-10)
    return x if flag == 1 else None


def least_violation(low, high, C, bound):
    """Least common violation of the rows within the bounds, by a linear program."""
    rows = np.isfinite(bound)
    length = np.linalg.norm(C, axis=1)[rows]
    length[length == 0.0] = 1.0
    A = np.column_stack([-C[rows] / length[:, None], -np.ones(rows.sum())])
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    limits = [*zip(low, high, strict=True), (0.0, None)]
    cost = np.eye(len(low) + 1)[-1]
    found = linprog(cost, A_ub=A, b_ub=-bound[rows] / length, bounds=limits, options=options)
    assert found.status == 0
    return found.fun


@pytest.mark.parametrize("part", range(5))
def test_random_programs(part):
    rng, infeasible, missed = np.random.default_rng([1983, part]), 0, 0
    for i in range(COUNT // 5):
        problem = make_problem(rng)
        state, x, y = solve(*problem)
        peer = solve_by_daqp(*problem)
        if state == SOLVED:
            assert violation(*problem[2:], x) < 1e-9 and max(kkt_errors(*problem, x, y)) < 1e-9, i
            if peer is not None:
                np.testing.assert_allclose(x, peer, rtol=0, atol=1e-8 * (1.0 + abs(x).max()))
        else:
            assert state == INFEASIBLE and certificate_error(*problem[2:], y) < 1e-7, i
            assert peer is None, i
        if i % 5 == 0 or (state == SOLVED and peer is None):
            assert (least_violation(*problem[2:]) < 1e-8) == (state == SOLVED), i
        infeasible += state == INFEASIBLE
        missed += state == SOLVED and peer is None
    print(f"{COUNT // 5} programs, {infeasible} infeasible, {missed} missed by daqp")
    assert 0.2 < infeasible / (COUNT // 5) < 0.35


def test_sizes_reach_the_declared_limits():
    rng = np.random.default_rng(0)
    sizes = {(len(p[1]), len(p[5])) for p in (make_problem(rng) for _ in range(5000))}
    assert max(n for n, _ in sizes) == MOST_UNKNOWNS and max(m for _, m in sizes) == MOST_ROWS
    assert min(n for n, _ in sizes) == 1 and min(m for _, m in sizes) == 0
