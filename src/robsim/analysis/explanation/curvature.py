"""The curvature of V at the end of a run, which shows whether V has a minimum there."""

from __future__ import annotations

import math

import numpy as np

from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.truth import true_features
from robsim.base.arrays import Array

STEP = 1e-5  # rad or m; central differences


def least_curvature(inquiry: Inquiry) -> float:
    """Return the least eigenvalue of the Hessian of V over its largest magnitude.

    The Hessian is over the commanded joints at the end of the run, from differences of the
    gradient (L J)' e; NaN if V is not known.
    """
    columns = inquiry.controller.columns
    n, q = columns.size, inquiry.snapshots[-1].q
    steps = STEP * np.concatenate([np.eye(n), -np.eye(n)], axis=1)
    truth = true_features(inquiry.case.task, inquiry.case.scene, _moved(inquiry, q, steps))
    if truth is None or not (np.isfinite(truth.error).all() and np.isfinite(truth.rates).all()):
        return math.nan
    gradient = np.einsum("tkn,tk->tn", truth.rates[..., columns], truth.error)
    H = (gradient[:n] - gradient[n:]) / (2 * STEP)
    eigenvalues = np.linalg.eigvalsh(0.5 * (H + H.T))
    return float(eigenvalues[0] / np.abs(eigenvalues).max())


def _moved(inquiry: Inquiry, q: Array, steps: Array) -> Array:
    """Return states (nq, B): q (nq, 1) moved by steps (n, B) of the commanded velocities."""
    scene, controller = inquiry.case.scene, inquiry.controller
    out = np.repeat(q, steps.shape[1], axis=1)
    velocities = np.zeros((scene.nv, steps.shape[1]))
    velocities[controller.columns] = steps
    scene.tree.flow(out, velocities, 1.0)
    return out
