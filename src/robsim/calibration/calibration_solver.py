"""Calibration by least squares: the mount of a camera, the pose of its target, and its lens."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable

import numpy as np

from robsim.base.arrays import make_read_only
from robsim.base.errors import FitWarning, InputError
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.calibration.calibration_model import select_unknowns
from robsim.calibration.calibration_result import Calibration
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.closed_form import SHAH, check_start, estimate_first_model
from robsim.calibration.fit_test import assess_fit
from robsim.calibration.misfit_trials import explain_failure, try_causes
from robsim.calibration.model_fit import ModelFit, fit_model
from robsim.calibration.parameter_covariance import estimate_covariance, invert_normal_matrix
from robsim.run.run_checks import check_instance
from robsim.vision.pixel_measurement import check_noise


def calibrate(
    views: CalibrationViews,
    also: Iterable[str] = (),
    *,
    start: str = SHAH,
    noise: float | None = None,
) -> Calibration:
    """Return the mount of a camera and the pose of its target from views, with their covariance.

    The estimate minimises the squared pixel errors

        sum |u - project(X^-1 A(q) Z p)|^2

    over the mount X = T_m_c of the camera in the frame m that carries it, the pose Z = T_f_o of the
    target in the frame f that carries it, and the parameters named in `also`. A(q) = T_m_f follows
    from the coordinates q of the joints, which are taken as exact (Strobl and Hirzinger 2006 also
    model their errors). The method is Levenberg-Marquardt. To first order the covariance is sigma^2
    (J'J)^-1 with sigma^2 = r'r / (M - P), for M residuals r and P parameters.

    Parameters
    ----------
    views : CalibrationViews
        Coordinates of the robot and pixels of the target.
    also : iterable of str, default ()
        Additional parameters: "focal", "center", "distortion" (as many coefficients as the camera
        has), "scale" (the size of the target relative to its marks), or names of coordinates such
        as "joint2", for the offset of their encoders.
    start : {"shah", "tsai_lenz", "park_martin", "daniilidis"}, default "shah"
        Closed-form method for the first estimate.
    noise : float, optional
        Standard deviation of a pixel coordinate. Default: estimated from the residuals. The
        covariance is for the residuals if they are larger.

    Returns
    -------
    Calibration
        Estimated mount, target and lens.

    Raises
    ------
    InputError
        If the robot rotates about one axis only, the views do not determine all parameters (the
        error names them), or the first estimate has marks behind the camera.

    Warns
    -----
    FitWarning
        If the residuals are larger than the noise, given or within the views
        (`robsim.calibration.fit_test`). The warning names the worst view and the cause by trial.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> from robsim.calibration.simulated_views import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> calibration = calibrate(simulate_views(bench, bench.start + turns), ["focal", "center"])
    >>> calibration.holds(bench.scene), round(calibration.rms, 1)
    (True, 0.2)
    """
    check_instance(views, CalibrationViews, "views")
    free = select_unknowns(views, also)
    sigma = None if noise is None else check_noise(noise)
    count = 2 * int(views.seen.sum())
    if count <= len(free.names):
        raise InputError(
            f"views: {count} pixel coordinates do not determine {len(free.names)} parameters: "
            "take more views"
        )
    first = estimate_first_model(views, check_start(start), scaled=free.scaled)
    try:
        fit = fit_model(views, free, first)
    except InputError as error:
        raise InputError(f"{error}{explain_failure(views, free.also, sigma)}") from None
    calibration = _build_calibration(fit, sigma)
    if calibration.misfit:
        warnings.warn(calibration.misfit, FitWarning, stacklevel=find_user_stacklevel())
    return calibration


def _build_calibration(fit: ModelFit, noise: float | None) -> Calibration:
    """Return the calibration of a fit; raise InputError if a parameter is undetermined."""
    inverse = invert_normal_matrix(fit.rates, fit.free)
    test = assess_fit(fit, noise)
    trials = try_causes(fit, noise) if test.misfit else ()
    covariance, freedom = estimate_covariance(fit, inverse, test, trials)
    residuals = np.full(fit.views.pixels.shape, np.nan)
    residuals[fit.views.seen] = fit.residuals.reshape(-1, 2)
    return Calibration(
        views=fit.views,
        model=fit.model,
        free=fit.free,
        covariance=make_read_only(covariance),
        sigma=math.sqrt(test.variance),
        freedom=freedom,
        residuals=make_read_only(residuals),
        test=test,
        trials=trials,
    )
