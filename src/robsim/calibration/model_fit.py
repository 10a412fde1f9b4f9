"""The least-squares fit of a calibration model to views."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.value import Value
from robsim.calibration.calibration_model import (
    CalibrationModel,
    Unknowns,
    predict_pixels,
    predict_rates,
)
from robsim.calibration.calibration_views import CalibrationViews
from robsim.statistics.least_squares import ROUNDS, LeastSquaresProblem, minimise

CHECK = "do joints (rad, m) and views belong together, and are the marks of this size and order?"


@dataclass(frozen=True, eq=False)
class ModelFit(Value):
    """The model with the least reprojection error near a first estimate."""

    views: CalibrationViews
    free: Unknowns
    model: CalibrationModel
    residuals: Array  # (M,) pixels, reprojected minus measured, of the marks that are seen
    rates: Array  # (M, P), derivatives of the residuals by the parameters

    @property
    def freedom(self) -> int:
        """The number of residuals minus the number of parameters."""
        return len(self.residuals) - len(self.free.names)

    @property
    def squares(self) -> float:
        """The sum of the squared residuals."""
        return float(self.residuals @ self.residuals)

    @property
    def rms(self) -> float:
        """The root mean square of the residuals, in pixels."""
        return float(np.sqrt(self.squares / len(self.residuals)))


def fit_model(
    views: CalibrationViews, free: Unknowns, first: CalibrationModel, rounds: int = ROUNDS
) -> ModelFit:
    """Return the fit near a first estimate, in which all marks must be in front of the camera."""
    problem = _build_problem(views, free)
    if not np.isfinite(problem.residuals(first)).all():
        seen = np.isfinite(predict_pixels(first, views.thing.marks, views.chain, views.q)).all(
            axis=2
        )
        view, mark = np.argwhere(views.seen & ~seen)[0].tolist()
        raise InputError(
            f"views: mark {mark} of view {view} is behind the camera in the closed-form "
            f"estimate: {CHECK}"
        )
    try:
        model = minimise(problem, first, rounds)
    except np.linalg.LinAlgError as error:
        raise InputError(f"views: the fit failed ({format_value(str(error))}): {CHECK}") from None
    return ModelFit(views, free, model, problem.residuals(model), problem.rates(model))


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
