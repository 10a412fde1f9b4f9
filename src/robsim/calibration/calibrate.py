"""`calibrate`: the mount of a camera, the place of its target, and its lens, from views."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.errors import FitWarning, InputError, is_one_of, naming, said, suggest
from robsim.base.warned import callers
from robsim.calibration.hand_eye import METHODS, hand_eye
from robsim.calibration.least_squares import Problem, minimised, triangle
from robsim.calibration.model import Model, Unknowns, pixels_of, rates_of, unknowns
from robsim.calibration.motions import mean_pose
from robsim.calibration.result import Calibration
from robsim.calibration.robot_world import robot_world
from robsim.calibration.views import CalibrationViews
from robsim.geometry.pose import Pose
from robsim.run.checks import of_kind
from robsim.vision.image import deviation
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
    >>> from robsim.calibration.observing import observe
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> found = calibrate(observe(bench, bench.start + turns), ["focal", "center"])
    >>> found.holds(bench.scene), round(found.rms, 1)
    (True, 0.2)
    """
    of_kind(views, CalibrationViews, "views")
    free = unknowns(views, also)
    sigma = None if noise is None else deviation(noise)
    count = 2 * int(views.seen.sum())
    if count <= len(free.names):
        raise InputError(
            f"views: {count} pixel coordinates do not tell {len(free.names)} numbers: take more"
        )
    try:
        found = _found(views, free, start, sigma)
    except np.linalg.LinAlgError as error:
        raise InputError(f"views: no least squares ({said(str(error))}): {CHECK}") from None
    if found.misfit:
        warnings.warn(found.misfit, FitWarning, stacklevel=callers())
    return found


def _found(views: CalibrationViews, free: Unknowns, start: str, sigma: float | None) -> Calibration:
    """Return the calibration; InputError where the closed form puts marks behind the camera."""
    problem, first = _problem(views, free), _first(views, start)
    if not np.isfinite(problem.residuals(first)).all():
        seen = np.isfinite(pixels_of(first, views.thing.marks, views.chain, views.q)).all(axis=2)
        view, mark = np.argwhere(views.seen & ~seen)[0].tolist()
        raise InputError(
            f"views: mark {mark} of view {view} would be behind the camera, as the closed form "
            f"has it: {CHECK}"
        )
    return _result(views, free, minimised(problem, first), problem, sigma)


def _problem(views: CalibrationViews, free: Unknowns) -> Problem[Model]:
    """Return the residuals of the marks that are seen."""
    seen, marks, chain, q = views.seen, views.thing.marks, views.chain, views.q

    def residuals(model: Model) -> Array:
        return np.asarray((pixels_of(model, marks, chain, q) - views.pixels)[seen].ravel())

    def rates(model: Model) -> Array:
        J = rates_of(model, marks, chain, q, free)
        return np.asarray(J[seen].reshape(-1, len(free.names)))

    return Problem(residuals, rates, lambda model, step: model.moved(step, free))


def _first(views: CalibrationViews, start: str) -> Model:
    """Return the mount and the place in closed form, from the pose of the target in each view."""
    known = [SHAH, *METHODS]
    if not is_one_of(start, known):
        raise InputError(f"start: no method {said(start)}; {suggest(start, known, 'methods')}")
    A, B, sure = Pose(views.poses()), *_poses(views)
    some = np.flatnonzero(sure)
    if start == SHAH:
        X, Z = robot_world(A[some], B[some])
    else:
        X = hand_eye(A[some], B[some], start)
        Z = mean_pose(A[some].inv() @ X @ B[some])
    return Model(X, Z, views.lens, np.zeros(views.scene.nq))


def _poses(views: CalibrationViews) -> tuple[Pose, Any]:
    """Return the poses T_c_o (V, 4, 4) of the target, and which are not ambiguous.

    All count as sure where fewer than three are. InputError: a view that shows no pose.
    """
    T, sure = np.empty((len(views), 4, 4)), np.zeros(len(views), dtype=bool)
    patterns, group = np.unique(views.seen, axis=0, return_inverse=True)
    for number, seen in enumerate(patterns):
        some = np.flatnonzero(group.reshape(-1) == number)
        with naming(f"pixels: marks seen in view {some[0]}"):
            found = estimate_pose(views.thing.marks[seen], views.pixels[some][:, seen], views.lens)
        T[some], sure[some] = found.T_c_o, ~found.ambiguous
    lost = np.flatnonzero(~np.isfinite(T).all((1, 2)))
    if lost.size:
        raise InputError(f"pixels: view {lost[0]} shows no pose of the target: leave it out")
    return Pose(T), sure if sure.sum() >= 3 else np.ones_like(sure)


def _result(
    views: CalibrationViews,
    free: Unknowns,
    model: Model,
    problem: Problem[Model],
    sigma: float | None,
) -> Calibration:
    """Return the calibration at the least squares, once all numbers are told by the views."""
    r, J = problem.residuals(model), problem.rates(model)
    inverse = _inverse(J, free)
    freedom = len(r) - len(free.names)
    variance = float(r @ r) / freedom if sigma is None else sigma**2
    residuals = np.full(views.pixels.shape, np.nan)
    residuals[views.seen] = r.reshape(-1, 2)
    return Calibration(
        views=views,
        model=model,
        free=free,
        covariance=frozen(variance * inverse),
        sigma=math.sqrt(variance),
        freedom=float(freedom) if sigma is None else math.inf,
        residuals=frozen(residuals),
    )


def _inverse(J: Array, free: Unknowns) -> Array:
    """Return (J'J)^-1 (P, P); InputError names numbers that the views do not tell."""
    scale = np.sqrt(np.square(J).sum(axis=0))
    dark = [name for name, size in zip(free.names, scale, strict=True) if not size > 0.0]
    if dark:
        raise InputError(f"views: nothing in them depends on {', '.join(dark)}")
    _, s, Vt = np.linalg.svd(triangle(J / scale))
    if s[-1] <= RANK * s[0]:
        open_ = [n for n, x in zip(free.names, np.abs(Vt[-1]), strict=True) if x > DIRECTION]
        raise InputError(
            f"views: they do not tell {', '.join(open_)} apart; turn the arm about more axes, or "
            "leave something out of also="
        )
    half = Vt.T / s / scale[:, None]
    inverse: Array = half @ half.T
    return inverse
