"""`calibrate`: the mount of a camera, the place of its target, and its lens, from views."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np

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
from robsim.calibration.least_squares import LeastSquaresProblem, minimise, triangular_factor
from robsim.calibration.relative_motions import mean_pose
from robsim.calibration.robot_world import solve_robot_world
from robsim.geometry.pose import Pose
from robsim.run.run_checks import check_instance
from robsim.vision.pixel_measurement import check_noise
from robsim.vision.pose_estimation import estimate_pose

SHAH = "shah"
RANK = 1e-9  # relative: smaller singular values of the scaled rates count as zero
CHECK = "do joints (rad, m) and views belong together, and are the marks of this size and order?"
DIRECTION = 0.3  # share of a number in a direction that the views leave open, to be told


def calibrate(
    views: CalibrationViews,
    also: Iterable[str] = (),
    *,
    start: str = SHAH,
    noise: float | None = None,
) -> Calibration:
    """Return the mount of a camera and the place of its target from views, with their covariance.

    views  see `CalibrationViews`
    also   what else is estimated: "focal", "center", "distortion" (as many coefficients as the
           camera has), or names of coordinates such as "joint2", whose encoders have an offset
    start  closed form from which it begins: "shah", "tsai_lenz", "park_martin" or "daniilidis"
    noise  standard deviation of a pixel coordinate; None: estimated from what remains

    The least squares of all pixels, sum |u - project(X^-1 A(q) Z p)|^2 over X = T_m_c, Z = T_f_o
    and what is named in `also`, by the method of Levenberg and Marquardt (Strobl and Hirzinger 2006
    weigh it so; here pixels alone have errors, and the joints none). To first order the covariance
    is sigma^2 (J'J)^-1, with sigma^2 = r'r / (M - P) of M residuals and P numbers.

    InputError: turns about one axis only; numbers that these views do not tell, and which; poses
    that put marks behind the camera. FitWarning: the marks are farther off than 3 pixels (rms) and
    three times the noise that is given; it names the worst view.

    >>> from robsim import examples, load_scenario
    >>> from robsim.calibration.simulated_views import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> found = calibrate(simulate_views(bench, bench.start + turns), ["focal", "center"])
    >>> found.holds(bench.scene), round(found.rms, 1)
    (True, 0.2)
    """
    check_instance(views, CalibrationViews, "views")
    free = select_unknowns(views, also)
    sigma = None if noise is None else check_noise(noise)
    count = 2 * int(views.seen.sum())
    if count <= len(free.names):
        raise InputError(
            f"views: {count} pixel coordinates do not tell {len(free.names)} numbers: take more"
        )
    try:
        found = _fit_calibration(views, free, start, sigma)
    except np.linalg.LinAlgError as error:
        raise InputError(f"views: no least squares ({format_value(str(error))}): {CHECK}") from None
    if found.misfit:
        warnings.warn(found.misfit, FitWarning, stacklevel=find_user_stacklevel())
    return found


def _fit_calibration(
    views: CalibrationViews, free: Unknowns, start: str, sigma: float | None
) -> Calibration:
    """Return the calibration; InputError where the closed form puts marks behind the camera."""
    problem, first = _build_problem(views, free), _start_model(views, start)
    if not np.isfinite(problem.residuals(first)).all():
        seen = np.isfinite(predict_pixels(first, views.thing.marks, views.chain, views.q)).all(
            axis=2
        )
        view, mark = np.argwhere(views.seen & ~seen)[0].tolist()
        raise InputError(
            f"views: mark {mark} of view {view} would be behind the camera, as the closed form "
            f"has it: {CHECK}"
        )
    return _build_calibration(views, free, minimise(problem, first), problem, sigma)


def _build_problem(
    views: CalibrationViews, free: Unknowns
) -> LeastSquaresProblem[CalibrationModel]:
    """Return the residuals of the marks that are seen."""
    seen, marks, chain, q = views.seen, views.thing.marks, views.chain, views.q

    def residuals(model: CalibrationModel) -> Array:
        return np.asarray((predict_pixels(model, marks, chain, q) - views.pixels)[seen].ravel())

    def rates(model: CalibrationModel) -> Array:
        J = predict_rates(model, marks, chain, q, free)
        return np.asarray(J[seen].reshape(-1, len(free.names)))

    return LeastSquaresProblem(residuals, rates, lambda model, step: model.moved(step, free))


def _start_model(views: CalibrationViews, start: str) -> CalibrationModel:
    """Return the mount and the place in closed form, from the pose of the target in each view."""
    known = [SHAH, *METHODS]
    if not is_known_name(start, known):
        raise InputError(
            f"start: no method {format_value(start)}; {suggest_names(start, known, 'methods')}"
        )
    A, B, sure = Pose(views.poses()), *_estimate_target_poses(views)
    some = np.flatnonzero(sure)
    if start == SHAH:
        X, Z = solve_robot_world(A[some], B[some])
    else:
        X = solve_hand_eye(A[some], B[some], start)
        Z = mean_pose(A[some].inv() @ X @ B[some])
    return CalibrationModel(X, Z, views.lens, np.zeros(views.scene.nq))


def _estimate_target_poses(views: CalibrationViews) -> tuple[Pose, Any]:
    """Return the poses T_c_o (V, 4, 4) of the target, and which are not ambiguous.

    All count as sure where fewer than three are. InputError: a view that shows no pose.
    """
    T, sure = np.empty((len(views), 4, 4)), np.zeros(len(views), dtype=bool)
    patterns, group = np.unique(views.seen, axis=0, return_inverse=True)
    for number, seen in enumerate(patterns):
        some = np.flatnonzero(group.reshape(-1) == number)
        with prefix_errors(f"pixels: marks seen in view {some[0]}"):
            found = estimate_pose(views.thing.marks[seen], views.pixels[some][:, seen], views.lens)
        T[some], sure[some] = found.T_c_o, ~found.ambiguous
    lost = np.flatnonzero(~np.isfinite(T).all((1, 2)))
    if lost.size:
        raise InputError(f"pixels: view {lost[0]} shows no pose of the target: leave it out")
    return Pose(T), sure if sure.sum() >= 3 else np.ones_like(sure)


def _build_calibration(
    views: CalibrationViews,
    free: Unknowns,
    model: CalibrationModel,
    problem: LeastSquaresProblem[CalibrationModel],
    sigma: float | None,
) -> Calibration:
    """Return the calibration at the least squares, once all numbers are told by the views."""
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
    """Return (J'J)^-1 (P, P); InputError names numbers that the views do not tell."""
    scale = np.sqrt(np.square(J).sum(axis=0))
    dark = [name for name, size in zip(free.names, scale, strict=True) if not size > 0.0]
    if dark:
        raise InputError(f"views: nothing in them depends on {', '.join(dark)}")
    _, s, Vt = np.linalg.svd(triangular_factor(J / scale))
    if s[-1] <= RANK * s[0]:
        open_ = [n for n, x in zip(free.names, np.abs(Vt[-1]), strict=True) if x > DIRECTION]
        raise InputError(
            f"views: they do not tell {', '.join(open_)} apart; turn the arm about more axes, or "
            "leave something out of also="
        )
    half = Vt.T / s / scale[:, None]
    inverse: Array = half @ half.T
    return inverse
