"""Explanations of a misfit by trial: each cause is assumed, and the calibration fitted again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.calibration.calibration_model import (
    LENS,
    SCALE,
    CalibrationModel,
    predict_pixels,
    select_unknowns,
    single_joints,
)
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.closed_form import estimate_first_model
from robsim.calibration.fit_test import assess_fit
from robsim.calibration.model_fit import ModelFit, fit_model
from robsim.calibration.view_faults import ViewFault, list_view_faults
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera

TIE = 10.0  # difference of BIC below which causes are about as likely (Kass and Raftery 1995)
EQUAL = 1e-2  # difference of BIC of causes with the same effect
LIKELY = 6  # trials that are tested
ROUNDS = 15  # most rounds of a trial: the fit of a true cause converges in fewer
LEAST = 1e-6  # pixels: smallest rms error of the criterion
UNIT_MARGIN = 0.1  # relative: sizes within this of a unit point to it
FINALISTS = 3  # faults of each kind with the least errors in closed form, which are fitted
UNITS = {1000: "millimetres", 100: "centimetres", 39.37: "inches"}  # in a metre


@dataclass(frozen=True, eq=False, repr=False)
class MisfitTrial(Value):
    """A calibration that is fitted again under an assumed cause of its misfit.

    Attributes
    ----------
    cause : str
        The assumed cause, as a plural noun: "marks 0.95 times as large".
    fit : ModelFit
        The fit under this cause.
    bic : float
        Bayesian information criterion (Schwarz 1978): smaller for the likelier cause.
    explains : bool
        Whether the cause is one of the likeliest, and its residuals are as small as noise.
    """

    cause: str
    fit: ModelFit
    bic: float
    explains: bool

    @property
    def rms(self) -> float:
        """The root mean square of the residuals under this cause, in pixels."""
        return self.fit.rms

    @property
    def mount(self) -> Pose:
        """The mount of the camera under this cause."""
        return self.fit.model.mount

    def __repr__(self) -> str:
        return f"<MisfitTrial {self.cause}: {self.rms:.3g} px>"


class CauseFit(NamedTuple):
    """A fit under a cause, and the number of parameters and residuals that the cause takes."""

    cause: str
    fit: ModelFit
    spent: int


def try_causes(fit: ModelFit, noise: float | None) -> tuple[MisfitTrial, ...]:
    """Return the trials of causes, the likeliest first.

    Faults of the data are tried if no additional parameter and no larger noise explains the misfit.
    """
    count = len(fit.residuals)
    judged = [] if noise is None else list(_try_noise(fit))
    judged += _judge_trials(list(_try_parameters(fit)), count, noise)
    if not any(trial.explains for trial in judged):
        judged += _judge_trials(list(_try_faults(fit.views, fit.free.also)), count, noise)
    return _rank_trials(judged)


def explain_failure(views: CalibrationViews, also: tuple[str, ...], noise: float | None) -> str:
    """Return the causes that explain views without a fit, in brackets, "" without such causes."""
    count = 2 * int(views.seen.sum())
    tried = [*_try_scale(views, also), *_try_faults(views, also)]
    trials = _rank_trials(_judge_trials(tried, count, noise))
    return f" ({describe_trials(trials)})" if list_explanations(trials) else ""


def _judge_trials(trials: list[CauseFit], count: int, noise: float | None) -> Iterator[MisfitTrial]:
    """Yield trials with their criterion, and whether the likeliest of them explain the misfit."""
    # rounded: causes with the same effect stay in their order, on every processor
    criteria = [round(_information_criterion(trial, count, noise), 6) for trial in trials]
    for place, i in enumerate(np.argsort(criteria, kind="stable").tolist()):
        explains = place < LIKELY and not assess_fit(trials[i].fit, noise).misfit
        yield MisfitTrial(trials[i].cause, trials[i].fit, criteria[i], explains)


def _rank_trials(trials: Iterable[MisfitTrial]) -> tuple[MisfitTrial, ...]:
    """Return trials by their criterion, without trials that are equal to another one."""
    ranked: list[MisfitTrial] = []
    for trial in sorted(trials, key=lambda trial: trial.bic):
        if not ranked or trial.bic > ranked[-1].bic + EQUAL:
            ranked.append(trial)
    return tuple(ranked)


def _try_noise(fit: ModelFit) -> Iterator[MisfitTrial]:
    """Yield the fit with estimated instead of given noise, if this explains the residuals."""
    if not assess_fit(fit, None).misfit:
        count = len(fit.residuals)
        criterion = _information_criterion(CauseFit("", fit, 1), count, None)
        yield MisfitTrial("pixels with more noise than this", fit, criterion, True)


def describe_trials(trials: tuple[MisfitTrial, ...]) -> str:
    """Return the causes that explain a misfit, or the nearest cause, as a clause.

    >>> describe_trials(())
    'no cause that was tried explains this'
    """
    named = list_explanations(trials)
    if named:
        return ", or ".join(f"{trial.cause} give {trial.rms:.3g} px" for trial in named)
    nearest = trials[0] if trials else None
    none = "no cause that was tried explains this"
    if nearest is None:
        return none
    return f"{none}; nearest: {nearest.cause} give {nearest.rms:.3g} px"


def list_explanations(trials: tuple[MisfitTrial, ...]) -> tuple[MisfitTrial, ...]:
    """Return the likeliest cause that explains a misfit, and causes that are nearly as likely."""
    able = [trial for trial in trials if trial.explains]
    return tuple(trial for trial in able if trial.bic <= able[0].bic + TIE)


def _information_criterion(trial: CauseFit, count: int, noise: float | None) -> float:
    """Return BIC = -2 log L + k log M of `count` residuals M, with the noise given or estimated.

    A residual of a view that is left out counts as a parameter.
    """
    parameters = len(trial.fit.free.names) + trial.spent
    squares = max(trial.fit.squares, count * LEAST**2)
    variance = squares / count if noise is None else noise**2
    return count * math.log(variance) + squares / variance + parameters * math.log(count)


def _try_scale(views: CalibrationViews, known: tuple[str, ...]) -> Iterator[CauseFit]:
    """Yield a fit with the size of the target as a parameter, from a start of any size."""
    try:
        first = estimate_first_model(views, scaled=True)
        fit = fit_model(views, select_unknowns(views, [*known, SCALE]), first, ROUNDS)
    except InputError:
        return
    yield CauseFit(_describe_scale(fit.model.scale), fit, 0)


def _describe_scale(scale: float) -> str:
    """Return a size of the target in words, with the unit that it points to.

    >>> _describe_scale(0.0010003)
    'marks 0.001 times as large (marks in millimetres?)'
    """
    text = f"marks {float(f'{scale:.3g}'):.10g} times as large"
    for factor, unit in UNITS.items():
        for name, ratio in (("marks", scale * factor), ("positions", scale / factor)):
            if abs(ratio - 1.0) < UNIT_MARGIN:
                text += f" ({name} in {unit}?)"
    return text


def _try_parameters(fit: ModelFit) -> Iterator[CauseFit]:
    """Yield fits with one more parameter: size of the target, lens, or offset of a joint."""
    views, known = fit.views, fit.free.also
    if SCALE not in known:
        yield from _try_scale(views, known)
    joints = [name for name, _ in single_joints(views)]
    for name in (*LENS, *joints):
        if name in known:
            continue
        wanted, first = views, fit.model
        if name == "distortion" and not views.lens.distortion:
            first = replace(first, camera=replace(first.camera, distortion=(0.0,) * 4))
            wanted = _with_camera(views, first.camera)
        try:
            trial = fit_model(wanted, select_unknowns(wanted, [*known, name]), first, ROUNDS)
        except InputError:
            continue
        yield CauseFit(_describe_parameter(name, trial.model, fit), trial, 0)


def _describe_parameter(name: str, model: CalibrationModel, fit: ModelFit) -> str:
    """Return the estimated value of an additional parameter, as a plural noun."""
    K = model.camera.K
    if name == "focal":
        times = K[0, 0] / fit.model.camera.K[0, 0]
        return f"focal lengths {times:.3g} times as long ({K[0, 0]:.5g} and {K[1, 1]:.5g} px)"
    if name == "center":
        return f"coordinates ({K[0, 2]:.5g}, {K[1, 2]:.5g}) of the principal point"
    if name == "distortion":
        values = ", ".join(f"{value:.3g}" for value in model.camera.distortion)
        return f"coefficients of distortion ({values})"
    i = fit.views.scene.coordinate_names.index(name)
    offset, unit = model.offsets[i], fit.views.scene.coordinate_units[i]
    size = f"{np.degrees(offset):.3g} deg" if unit == "rad" else f"{1e3 * offset:.3g} mm"
    return f"encoders with an offset of {size} of joint '{name}'"


def _with_camera(views: CalibrationViews, camera: Camera) -> CalibrationViews:
    """Return the views with another lens of their camera."""
    eye = replace(views.eye, camera=camera)
    return replace(views, scene=views.scene.replacing(eye))


def _try_faults(views: CalibrationViews, also: tuple[str, ...]) -> Iterator[CauseFit]:
    """Yield fits to the repaired views of common faults."""
    for kind in list_view_faults(views):
        for fault, first in _select_finalists(kind):
            try:
                free = select_unknowns(fault.views, also)
                trial = fit_model(fault.views, free, first, ROUNDS)
            except InputError:
                continue
            spent = 2 * int(views.seen.sum() - fault.views.seen.sum())
            yield CauseFit(fault.repair, trial, spent)


def _select_finalists(faults: Iterable[ViewFault]) -> list[tuple[ViewFault, CalibrationModel]]:
    """Return the faults with the least errors in closed form, and their first estimates."""
    ranked = []
    for fault in faults:
        try:
            model = estimate_first_model(fault.views, poses=fault.poses)
        except (InputError, np.linalg.LinAlgError):
            continue
        error = _closed_form_error(fault.views, model)
        if math.isfinite(error):
            ranked.append((error, fault, model))
    ranked.sort(key=lambda each: float(f"{each[0]:.8g}"))  # as equal criteria
    return [(fault, model) for _, fault, model in ranked[:FINALISTS]]


def _closed_form_error(views: CalibrationViews, model: CalibrationModel) -> float:
    """Return the mean square of the errors in pixels, NaN for a mark behind the camera."""
    residuals = predict_pixels(model, views.thing.marks, views.chain, views.q) - views.pixels
    return float(np.square(residuals[views.seen]).mean())
