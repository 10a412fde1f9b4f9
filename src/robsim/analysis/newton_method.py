"""Damped Newton's method for f(q) = 0, from many starts at once."""

from __future__ import annotations

import numpy as np

from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array, euclidean_length, select_runs, view_runs_first

ITERATIONS = 40
LONGEST = 0.5  # metres or radians, the longest step
STEP_SHARES = np.array([1.0, 0.5, 0.2, 0.05])  # shares of a step, of which the best is taken
RCOND = 1e-7  # singular values of df/dq below this share of the largest count as zero
RESIDUAL = 1e-11  # norm of f over the pace, below which a state is an equilibrium


def refine_equilibria(field: VectorField, q: Array) -> Array:
    """Return equilibria (nq, E) near states (nq, B); states from which none is found are left out.

    Damped Newton steps dq = -(df/dq)^+ f: of some shares of a step the one with the smallest
    residual ||f|| is taken, and a run for which none makes it smaller is given up.
    """
    q, found, enough = q.copy(), [], RESIDUAL * field.controller.pace
    f = field.rates(q)
    for _ in range(ITERATIONS):
        residual = euclidean_length(f)  # NaN for states that were given up
        there, going = residual <= enough, residual > enough
        found.append(q[:, there])
        q, f = (select_runs(array, going) for array in (q, f))
        if not q.shape[1]:
            break
        q, f = _newton_step(field, q, f)
    return _wrap_into_limits(field, np.ascontiguousarray(np.concatenate(found, axis=1)), enough)


def _wrap_into_limits(field: VectorField, q: Array, enough: float) -> Array:
    """Return states turned into the joint limits, where they are equilibria there too.

    A secondary motion may depend on full turns of a joint.
    """
    turned = field.within_limits(q)
    return np.where(euclidean_length(field.rates(turned)) <= enough, turned, q)


def _newton_step(field: VectorField, q: Array, f: Array) -> tuple[Array, Array]:
    """Return the next states and their f, which is NaN where no share of the step reduces it."""
    J = view_runs_first(field.jacobian(q))
    usable = np.asarray(np.isfinite(J).all(axis=(1, 2)))
    inverse = np.linalg.pinv(np.where(usable[:, None, None], J, 0.0), rcond=RCOND)
    dq = -np.einsum("bij,jb->ib", inverse, f)
    dq *= np.minimum(1.0, LONGEST / np.maximum(euclidean_length(dq), 1e-300))
    tried = (STEP_SHARES[:, None, None] * dq).transpose(1, 0, 2)
    shape = len(q), len(STEP_SHARES), q.shape[1]
    wide = np.ascontiguousarray(np.broadcast_to(q[:, None], shape)).reshape(len(q), -1)
    states = field.moved(wide, np.ascontiguousarray(tried).reshape(len(dq), -1))
    rates = field.rates(states).reshape(len(f), *shape[1:])
    residuals = np.nan_to_num(euclidean_length(rates), nan=np.inf)
    best = residuals.argmin(axis=0), np.arange(q.shape[1])
    worse = ~(residuals[best] < euclidean_length(f))
    after = np.where(worse, np.nan, rates[:, *best])
    return np.ascontiguousarray(states.reshape(shape)[:, *best]), np.ascontiguousarray(after)
