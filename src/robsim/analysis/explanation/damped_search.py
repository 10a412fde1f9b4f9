"""Searches of the state with the least error, from many states at once, by damped steps.

The steps are dx = -(A'A + mu I)^-1 A'e of the error e with the rates A (Levenberg 1944; Marquardt
1963), with a damping mu of each search: it falls after a step that reduces the error, and rises
after another step, which is not taken.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.base.arrays import Array

FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-12, 1e12  # relative to the trace of A'A
TINY = 1e-300


def minimise_errors(
    evaluate: Callable[[Array], tuple[Array, Array]],
    displace: Callable[[Array, Array], Array],
    states: Array,
    rounds: int,
) -> tuple[Array, Array]:
    """Return the states (..., B) at the end of the searches, and their errors (B, k).

    Parameters
    ----------
    evaluate : callable
        Errors (B, k) and rates (B, k, n) of states (..., B). An error is infinite, and the rates
        are zero, where a state has none.
    displace : callable
        States (..., B) after steps (B, n).
    states : ndarray of shape (..., B)
        States from which the searches begin.
    rounds : int
        Number of steps.
    """
    e, A = evaluate(states)
    damping = np.full(states.shape[-1], FIRST_DAMPING)
    for _ in range(rounds):
        next_states = displace(states, _compute_steps(e, A, damping))
        next_e, next_A = evaluate(next_states)
        better = np.square(next_e).sum(axis=1) < np.square(e).sum(axis=1)
        damping = np.where(better, damping / 5, damping * 4)
        damping = np.clip(damping, LEAST_DAMPING, MOST_DAMPING)
        states = np.ascontiguousarray(np.where(better, next_states, states))
        e = np.where(better[:, None], next_e, e)
        A = np.where(better[:, None, None], next_A, A)
    return states, e


def shorten_steps(steps: Array, sizes: Array, longest: float) -> Array:
    """Return steps (B, n) of some sizes (B,), shortened to a longest size."""
    return np.asarray(steps * np.minimum(1.0, longest / np.maximum(sizes, TINY))[:, None])


def _compute_steps(e: Array, A: Array, damping: Array) -> Array:
    """Return damped steps (B, n), zero where the error is infinite."""
    H = np.swapaxes(A, 1, 2) @ A
    size = np.maximum(np.trace(H, axis1=1, axis2=2), TINY)
    H += (damping * size)[:, None, None] * np.eye(H.shape[1])
    g = np.einsum("bkn,bk->bn", A, np.where(np.isfinite(e), e, 0.0))
    return np.asarray(-np.linalg.solve(H, g[..., None])[..., 0])
