"""Nonlinear least squares by the method of Levenberg and Marquardt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError

S = TypeVar("S")
ROUNDS = 100
FIRST_DAMPING, MOST_DAMPING = 1e-4, 1e8
BLOCK = 128  # rows factorised together
ROUNDING = 1e-12  # relative: a sum of squares that is larger by less counts as equal
ARRIVED = 1e-9  # pixels: norm of the changes of all pixels below which the iteration ends


class LeastSquaresProblem(NamedTuple, Generic[S]):
    """The functions of a least-squares problem with M residuals and P parameters."""

    residuals: Callable[[S], Array]  # residuals (M,) of a state
    rates: Callable[[S], Array]  # Jacobian (M, P) of the residuals
    add_step: Callable[[S, Array], S]  # state after a step (P,) of the parameters


def minimise(
    problem: LeastSquaresProblem[S],
    state: S,
    rounds: int = ROUNDS,
    arrived: float = ARRIVED,
    share: float = 0.0,
) -> S:
    """Return the state with the least sum of squared residuals near a first state.

    Each step solves (J'J + damping D) dp = -J'r with the diagonal D of J'J (Marquardt 1963), by
    orthogonal factorisation. The damping falls tenfold after a successful step and rises tenfold
    after a failed step. The iteration ends with a step that changes the residuals by less than
    `arrived`, or by less than a `share` of their norm.
    """
    damping, r = FIRST_DAMPING, problem.residuals(state)
    for _ in range(rounds):
        J = problem.rates(state)
        scale = np.sqrt(np.square(J).sum(axis=0))
        scale[scale == 0.0] = 1.0
        R, c = np.split(
            triangular_factor(np.column_stack([J / scale, r]))[: len(scale)], [-1], axis=1
        )
        while damping <= MOST_DAMPING:
            step = _solve_damped_step(R, c[:, 0], damping)
            candidate, r_candidate = _try_step(problem, state, step / scale)
            if r_candidate @ r_candidate <= (1.0 + ROUNDING) * (r @ r):
                break
            damping *= 10.0
        else:
            return state
        state, r, damping = candidate, r_candidate, damping / 10.0
        if step @ step <= max(arrived**2, share**2 * float(r @ r)):
            return state
    return state


def triangular_factor(M: Array) -> Array:
    """Return the upper triangle R (n, n) of M = Q R, M (rows, n), by blocks of rows.

    LAPACK uses a single thread for blocks of this size, so the result does not depend on the number
    of threads.

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
    """Return the damped step (P,) for a Jacobian Q R with columns of length one, and c = Q'r."""
    count = len(c)
    M = np.concatenate([R, np.sqrt(damping) * np.eye(count)])
    step: Array = np.linalg.lstsq(M, np.concatenate([-c, np.zeros(count)]), rcond=None)[0]
    return step


def _try_step(problem: LeastSquaresProblem[S], state: S, step: Array) -> tuple[S, Array]:
    """Return the state after a step and its residuals; infinite residuals if it is invalid."""
    try:
        candidate = problem.add_step(state, step)
    except InputError:  # for example a focal length below zero
        return state, np.array([np.inf])
    r = problem.residuals(candidate)
    return candidate, r if np.isfinite(r).all() else np.array([np.inf])
