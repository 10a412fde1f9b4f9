"""Calibration by least squares: the mount of a camera, the pose of its target, and its lens."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import (
    FitWarning,
    InputError,
    format_value,
    is_known_name,
    prefix_errors,
    suggest_names,
)
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.calibration.calibration_model import (
    CalibrationModel,
    Unknowns,
    predict_pixels,
    predict_rates,
    select_unknowns,
)
from robsim.calibration.calibration_result import Calibration
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.hand_eye import METHODS, solve_hand_eye
from robsim.calibration.relative_motions import mean_pose
from robsim.calibration.robot_world import solve_robot_world
from robsim.geometry.pose import Pose
from robsim.run.run_checks import check_instance
from robsim.statistics.least_squares import LeastSquaresProblem, minimise, triangular_factor
from robsim.vision.pixel_measurement import check_noise
from robsim.vision.pose_estimation import estimate_pose

SHAH = "shah"
RANK = 1e-9  # relative: smaller singular values of the scaled Jacobian count as zero
CHECK = "do joints (rad, m) and views belong together, and are the marks of this size and order?"
DIRECTION = 0.3  # an error names parameters with a larger component in an undetermined direction


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
        has), or names of coordinates such as "joint2", for the offset of their encoders.
    start : {"shah", "tsai_lenz", "park_martin", "daniilidis"}, default "shah"
        Closed-form method for the first estimate.
    noise : float, optional
        Standard deviation of a pixel coordinate. Default: estimated from the residuals.

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
        If the rms error exceeds 3 pixels, and three times `noise` if it is not None. The warning
        names the worst view.

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
    try:
        calibration = _fit_calibration(views, free, start, sigma)
    except np.linalg.LinAlgError as error:
        raise InputError(f"views: the fit failed ({format_value(str(error))}): {CHECK}") from None
    if calibration.misfit:
        warnings.warn(calibration.misfit, FitWarning, stacklevel=find_user_stacklevel())
    return calibration


def _fit_calibration(
    views: CalibrationViews, free: Unknowns, start: str, sigma: float | None
) -> Calibration:
    """Return the calibration; all marks must be in front of the camera in the first estimate."""
    problem, first = _build_problem(views, free), _start_model(views, start)
    if not np.isfinite(problem.residuals(first)).all():
        seen = np.isfinite(predict_pixels(first, views.thing.marks, views.chain, views.q)).all(
            axis=2
        )
        view, mark = np.argwhere(views.seen & ~seen)[0].tolist()
        raise InputError(
            f"views: mark {mark} of view {view} is behind the camera in the closed-form "
            f"estimate: {CHECK}"
        )
    return _build_calibration(views, free, minimise(problem, first), problem, sigma)


def _build_problem(
    views: CalibrationViews, free: Unknowns
) -> LeastSquaresProblem[CalibrationModel]:
    """Return the least-squares problem of the visible marks."""
    seen, marks, chain, q = views.seen, views.thing.marks, views.chain, views.q

    def residuals(model: CalibrationModel) -> Array:
        return np.asarray((predict_pixels(model, marks, chain, q) - views.pixels)[seen].ravel())

    def rates(model: CalibrationModel) -> Array:
        J = predict_rates(model, marks, chain, q, free)
        return np.asarray(J[seen].reshape(-1, len(free.names)))

    return LeastSquaresProblem(residuals, rates, lambda model, step: model.add_step(step, free))


def _start_model(views: CalibrationViews, start: str) -> CalibrationModel:
    """Return the first estimate in closed form, from the pose of the target in each view."""
    known = [SHAH, *METHODS]
    if not is_known_name(start, known):
        raise InputError(
            f"start: no method {format_value(start)}; {suggest_names(start, known, 'methods')}"
        )
    A, B, certain = Pose(views.poses()), *_estimate_target_poses(views)
    used = np.flatnonzero(certain)
    if start == SHAH:
        X, Z = solve_robot_world(A[used], B[used])
    else:
        X = solve_hand_eye(A[used], B[used], start)
        Z = mean_pose(A[used].inv() @ X @ B[used])
    return CalibrationModel(X, Z, views.lens, np.zeros(views.scene.nq))


def _estimate_target_poses(views: CalibrationViews) -> tuple[Pose, NDArray[np.bool_]]:
    """Return the poses T_c_o (V, 4, 4) of the target, and whether (V,) they are used.

    Ambiguous poses are not used if at least three others remain. InputError is raised for a view
    without a pose.
    """
    T, certain = np.empty((len(views), 4, 4)), np.zeros(len(views), dtype=bool)
    patterns, group = np.unique(views.seen, axis=0, return_inverse=True)
    for number, seen in enumerate(patterns):
        group_views = np.flatnonzero(group.reshape(-1) == number)
        with prefix_errors(f"pixels: marks seen in view {group_views[0]}"):
            estimate = estimate_pose(
                views.thing.marks[seen], views.pixels[group_views][:, seen], views.lens
            )
        T[group_views], certain[group_views] = estimate.T_c_o, ~estimate.ambiguous
    lost = np.flatnonzero(~np.isfinite(T).all((1, 2)))
    if lost.size:
        raise InputError(f"pixels: view {lost[0]} shows no pose of the target: leave it out")
    return Pose(T), certain if certain.sum() >= 3 else np.ones_like(certain)


def _build_calibration(
    views: CalibrationViews,
    free: Unknowns,
    model: CalibrationModel,
    problem: LeastSquaresProblem[CalibrationModel],
    sigma: float | None,
) -> Calibration:
    """Return the calibration at the minimum; raise InputError if a parameter is undetermined."""
    r, J = problem.residuals(model), problem.rates(model)
    inverse = _invert_normal_matrix(J, free)
    freedom = len(r) - len(free.names)
    variance = float(r @ r) / freedom if sigma is None else sigma**2
    residuals = np.full(views.pixels.shape, np.nan)
    residuals[views.seen] = r.reshape(-1, 2)
    return Calibration(
        views=views,
        model=model,
        free=free,
        covariance=make_read_only(variance * inverse),
        sigma=math.sqrt(variance),
        freedom=float(freedom) if sigma is None else math.inf,
        residuals=make_read_only(residuals),
    )


def _invert_normal_matrix(J: Array, free: Unknowns) -> Array:
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
