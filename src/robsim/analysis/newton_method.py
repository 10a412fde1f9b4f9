"""Damped Newton's method for f(q) = 0, from many starts at once."""

from __future__ import annotations

import numpy as np

from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array, euclidean_length, select_runs, view_runs_first

ITERATIONS = 40
LONGEST = 0.5  # longest step, in metres or radians
STEP_SHARES = np.array([1.0, 0.5, 0.2, 0.05])  # factors of a step
RCOND = 1e-7  # largest zero singular value of df/dq, relative to the largest singular value
RESIDUAL = 1e-11  # largest norm of f at an equilibrium, relative to the slowest nominal rate


def refine_equilibria(field: VectorField, q: Array) -> Array:
    """Return the equilibria (nq, E) near states (nq, B); states without convergence are dropped.

    Each step is dq = -(df/dq)^+ f, shortened by the factor in STEP_SHARES with the smallest
    residual ||f||. A state is dropped if no factor reduces its residual.
    """
    q, equilibria, threshold = q.copy(), [], RESIDUAL * field.controller.pace
    f = field.rates(q)
    for _ in range(ITERATIONS):
        residual = euclidean_length(f)  # NaN for dropped states
        converged, active = residual <= threshold, residual > threshold
        equilibria.append(q[:, converged])
        q, f = (select_runs(array, active) for array in (q, f))
        if not q.shape[1]:
            break
        q, f = _newton_step(field, q, f)
    return _wrap_into_limits(
        field, np.ascontiguousarray(np.concatenate(equilibria, axis=1)), threshold
    )


def _wrap_into_limits(field: VectorField, q: Array, threshold: float) -> Array:
    """Return states shifted by full turns into the joint limits, if they are equilibria there too.

    A shifted state need not be an equilibrium: a secondary motion may depend on full turns.
    """
    shifted = field.within_limits(q)
    return np.where(euclidean_length(field.rates(shifted)) <= threshold, shifted, q)


def _newton_step(field: VectorField, q: Array, f: Array) -> tuple[Array, Array]:
    """Return the next states and their f, which is NaN if no step reduces it."""
    J = view_runs_first(field.jacobian(q))
    usable = np.asarray(np.isfinite(J).all(axis=(1, 2)))
    inverse = np.linalg.pinv(np.where(usable[:, None, None], J, 0.0), rcond=RCOND)
    dq = -np.einsum("bij,jb->ib", inverse, f)
    dq *= np.minimum(1.0, LONGEST / np.maximum(euclidean_length(dq), 1e-300))
    steps = (STEP_SHARES[:, None, None] * dq).transpose(1, 0, 2)
    shape = len(q), len(STEP_SHARES), q.shape[1]
    copies = np.ascontiguousarray(np.broadcast_to(q[:, None], shape)).reshape(len(q), -1)
    states = field.displace(copies, np.ascontiguousarray(steps).reshape(len(dq), -1))
    rates = field.rates(states).reshape(len(f), *shape[1:])
    residuals = np.nan_to_num(euclidean_length(rates), nan=np.inf)
    best = residuals.argmin(axis=0), np.arange(q.shape[1])
    worse = ~(residuals[best] < euclidean_length(f))
    next_f = np.where(worse, np.nan, rates[:, *best])
    return np.ascontiguousarray(states.reshape(shape)[:, *best]), np.ascontiguousarray(next_f)
