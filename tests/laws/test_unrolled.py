"""Code for known sizes, or in another order, gives the results of the code for any size."""

import numpy as np
import pytest

import robsim as rs
from robsim.kernels.linear_algebra import pseudoinverse
from robsim.kernels.machine.program import Program


def least_squares(A, y):
    """x (n, runs) and rank (runs,) of A (m, n, runs) and y (m, runs)."""
    x, rank = np.empty(A.shape[1:]), np.empty(A.shape[2], dtype=np.int64)
    pseudoinverse.least_squares(A, y, 0.0, 1e-12, x, rank)
    return x, rank


@pytest.mark.parametrize("unit", [1.0, 1e-100, 1e100])
def test_four_points_are_solved_with_the_bits_of_any_number_of_rows(unit):
    rng = np.random.default_rng(8)
    A, y = unit * rng.normal(size=(8, 6, 21)), rng.normal(size=(8, 21))
    A[:, 5, 3] = A[:, 4, 3]  # one run without full rank
    longer = np.concatenate([A, np.zeros((1, 6, 21))]), np.concatenate([y, np.zeros((1, 21))])
    (x, rank), (same, also) = least_squares(A, y), least_squares(*longer)
    full = np.arange(21) != 3
    np.testing.assert_array_equal(x[:, full], same[:, full])
    np.testing.assert_array_equal(rank[full], 6)
    np.testing.assert_array_equal(rank, also)
    if unit == 1.0:
        assert rank[3] == 5
        expected = [np.linalg.lstsq(A[..., b], y[:, b], rcond=1e-12)[0] for b in range(21)]
        np.testing.assert_allclose(x, np.transpose(expected), rtol=0, atol=1e-12)


@pytest.mark.parametrize("joint", range(6))
def test_a_joint_that_turned_very_often_is_where_it_would_be_after_one_turn(joint):
    robot = rs.robots.load("puma560")
    q = robot.home + np.random.default_rng(9).uniform(-1, 1, (9, 6))
    far = q.copy()
    far[4, joint] = 3e5
    found, near = robot.fk(far), robot.fk(q)
    q[4, joint] = np.arctan2(np.sin(3e5), np.cos(3e5))
    np.testing.assert_allclose(found[4], robot.fk(q[4]), rtol=0, atol=1e-14)
    others = np.arange(9) != 4
    np.testing.assert_array_equal(found[others], near[others])


def test_stages_work_in_the_same_rows():
    program = Program()
    first = program.scratch(5)
    assert [program.scratch(5), program.scratch(2), program.size] == [first, first, 5]
    more = program.scratch(9)
    assert [more, program.scratch(5), program.rows()] == [5, 5, 14]
