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
ARRIVED = 1e-9  # pixels, by which all marks together move: a shorter step ends the search


class Problem(NamedTuple, Generic[S]):
    """Residuals (M,) of a state, their rates (M, P), and the state after a step (P,)."""

    residuals: Callable[[S], Array]
    rates: Callable[[S], Array]
    moved: Callable[[S, Array], S]


def minimised(problem: Problem[S], state: S) -> S:
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
        while damping <= MOST_DAMPING:
            step = _step(J / scale, r, damping)
            tried, r_tried = _tried(problem, state, step / scale)
            if r_tried @ r_tried <= r @ r:
                break
            damping *= 10.0
        else:
            return state
        state, r, damping = tried, r_tried, damping / 10.0
        if step @ step <= ARRIVED**2:
            return state
    return state


def _step(J: Array, r: Array, damping: float) -> Array:
    """Return the damped step (P,) of a Jacobian whose columns have length one."""
    count = J.shape[1]
    M = np.concatenate([J, np.sqrt(damping) * np.eye(count)])
    step: Array = np.linalg.lstsq(M, np.concatenate([-r, np.zeros(count)]), rcond=None)[0]
    return step


def _tried(problem: Problem[S], state: S, step: Array) -> tuple[S, Array]:
    """Return the state after a step and its residuals; infinite where there is none."""
    try:
        there = problem.moved(state, step)
    except InputError:  # such as a focal length below zero
        return state, np.array([np.inf])
    r = problem.residuals(there)
    return there, r if np.isfinite(r).all() else np.array([np.inf])
