"""Least squares by the method of Levenberg and Marquardt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError

S = TypeVar("S")
ROUNDS = 100
FIRST_DAMPING, MOST_DAMPING = 1e-4, 1e8
BLOCK = 128  # rows that are factorised together
ROUNDING = 1e-12  # relative: a sum of squares that is larger by less counts as the same
ARRIVED = 1e-9  # pixels, by which all marks together move: a shorter step ends the search


class LeastSquaresProblem(NamedTuple, Generic[S]):
    """Residuals (M,) of a state, their rates (M, P), and the state after a step (P,)."""

    residuals: Callable[[S], Array]
    rates: Callable[[S], Array]
    moved: Callable[[S, Array], S]


def minimise(problem: LeastSquaresProblem[S], state: S) -> S:
    """Return the state of least squares near a first one.

    Each step solves (J'J + damping D) dp = -J'r with D the diagonal of J'J (Marquardt 1963), by
    orthogonal factorisation. The damping falls tenfold after a step that helps and rises tenfold
    before another try.
    """
    damping, r = FIRST_DAMPING, problem.residuals(state)
    for _ in range(ROUNDS):
        J = problem.rates(state)
        scale = np.sqrt(np.square(J).sum(axis=0))
        scale[scale == 0.0] = 1.0
        R, c = np.split(
            triangular_factor(np.column_stack([J / scale, r]))[: len(scale)], [-1], axis=1
        )
        while damping <= MOST_DAMPING:
            step = _solve_damped_step(R, c[:, 0], damping)
            tried, r_tried = _try_step(problem, state, step / scale)
            if r_tried @ r_tried <= (1.0 + ROUNDING) * (r @ r):
                break
            damping *= 10.0
        else:
            return state
        state, r, damping = tried, r_tried, damping / 10.0
        if step @ step <= ARRIVED**2:
            return state
    return state


def triangular_factor(M: Array) -> Array:
    """Return the upper triangle R (n, n) of M = Q R, M (rows, n), by blocks of rows.

    They are so small that LAPACK takes one thread for each, whose bits do not depend on how many
    there are.

    >>> np.abs(triangular_factor(np.ones((1000, 1)))) ** 2
    array([[1000.]])
    """
    n = M.shape[1]
    rows = max(BLOCK, 2 * n)
    while len(M) > rows:
        blocks = -(-len(M) // rows)
        padded = np.zeros((blocks * rows, n))
        padded[: len(M)] = M
        each = np.asarray(np.linalg.qr(padded.reshape(blocks, rows, n), "r"))
        M = each.reshape(-1, n)
    return np.asarray(np.linalg.qr(M, "r"))


def _solve_damped_step(R: Array, c: Array, damping: float) -> Array:
    """Return the damped step (P,) of rates Q R whose columns have length one, with c = Q'r."""
    count = len(c)
    M = np.concatenate([R, np.sqrt(damping) * np.eye(count)])
    step: Array = np.linalg.lstsq(M, np.concatenate([-c, np.zeros(count)]), rcond=None)[0]
    return step


def _try_step(problem: LeastSquaresProblem[S], state: S, step: Array) -> tuple[S, Array]:
    """Return the state after a step and its residuals; infinite where there is none."""
    try:
        there = problem.moved(state, step)
    except InputError:  # such as a focal length below zero
        return state, np.array([np.inf])
    r = problem.residuals(there)
    return there, r if np.isfinite(r).all() else np.array([np.inf])
