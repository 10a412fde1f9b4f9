"""The covariance of the parameters of a calibration."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.calibration.calibration_model import Unknowns
from robsim.calibration.fit_test import FitTest
from robsim.calibration.misfit_trials import MisfitTrial, list_explanations
from robsim.calibration.model_fit import ModelFit
from robsim.statistics.least_squares import triangular_factor

RANK = 1e-9  # relative: smaller singular values of the scaled Jacobian count as zero
DIRECTION = 0.3  # an error names parameters with a larger component in an undetermined direction


def estimate_covariance(
    fit: ModelFit, inverse: Array, test: FitTest, trials: tuple[MisfitTrial, ...]
) -> tuple[Array, float]:
    """Return the covariance (P, P) of the parameters, and its degrees of freedom.

    To first order it is s^2 (J'J)^-1, with `inverse` (J'J)^-1 and the variance s^2 of a pixel
    coordinate. In a misfit the errors of a view are not independent. Then the covariance is in
    every direction at least as large as the jackknife estimate, which leaves out one view at a
    time, and the step d to each calibration that explains the misfit adds d d'.
    """
    covariance = test.variance * inverse
    if not test.misfit:
        return covariance, test.freedom
    covariance = _largest_of(covariance, _jackknife(fit, inverse))
    for trial in list_explanations(trials):
        d = fit.model.step_to(trial.fit.model, fit.free)
        covariance = covariance + np.outer(d, d)
    return covariance, min(test.freedom, len(fit.views) - 1.0)


def _jackknife(fit: ModelFit, inverse: Array) -> Array:
    """Return the jackknife covariance (P, P) for errors that are independent between views.

    It is (V - 1) / V times the sum of d d' over the views, with the change d of the parameters if a
    view is left out, to first order (MacKinnon and White 1985, estimator HC3, for groups).
    """
    view = np.repeat(np.argwhere(fit.views.seen)[:, 0], 2)
    count = len(fit.views)
    steps = np.empty((count, len(inverse)))
    for i in range(count):
        J, r = fit.rates[view == i], fit.residuals[view == i]
        left = np.linalg.lstsq(np.eye(len(r)) - J @ inverse @ J.T, r, rcond=RANK)[0]
        steps[i] = inverse @ (J.T @ left)
    return np.asarray((count - 1) / count * steps.T @ steps)


def _largest_of(first: Array, second: Array) -> Array:
    """Return a covariance that is at least as large as two others in every direction.

    With first = L L' and the eigenvalues w and eigenvectors U of L^-1 second L^-T it is
    L U max(w, 1) U' L'.

    >>> _largest_of(np.diag([1.0, 4.0]), np.diag([9.0, 1.0]))
    array([[9., 0.],
           [0., 4.]])
    """
    size = np.sqrt(np.diag(first))
    L = np.linalg.cholesky(first / np.outer(size, size)) * size[:, None]
    M = np.linalg.solve(L, np.linalg.solve(L, second).T)
    w, U = np.linalg.eigh((M + M.T) / 2)
    half = L @ U * np.sqrt(np.maximum(w, 1.0))
    return np.asarray(half @ half.T)


def invert_normal_matrix(J: Array, free: Unknowns) -> Array:
    """Return (J'J)^-1 (P, P); raise InputError with the names of undetermined parameters."""
    scale = np.sqrt(np.square(J).sum(axis=0))
    unobserved = [name for name, size in zip(free.names, scale, strict=True) if not size > 0.0]
    if unobserved:
        raise InputError(f"views: their pixels do not depend on {', '.join(unobserved)}")
    _, s, Vt = np.linalg.svd(triangular_factor(J / scale))
    if s[-1] <= RANK * s[0]:
        undetermined = [n for n, x in zip(free.names, np.abs(Vt[-1]), strict=True) if x > DIRECTION]
        raise InputError(
            f"views: they do not determine {', '.join(undetermined)} separately; turn the arm "
            "about more axes, or estimate fewer parameters in also="
        )
    half = Vt.T / s / scale[:, None]
    inverse: Array = half @ half.T
    return inverse
