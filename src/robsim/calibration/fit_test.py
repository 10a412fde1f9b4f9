"""The test of a calibration for misfit: residuals against the noise of the pixels.

The noise is given, or estimated from each view by itself: from the residuals of a pose of the
target that is fitted to the view alone, without the joints. The squared residuals of a calibration
are the sum of two independent parts (a lack-of-fit test, Draper and Smith 1998, section 2.1):

    r'r = within + lack,

`within` of the free poses and of the parameters of the lens, and `lack` of the joints, the mount,
the place, and the size of the target. Divided by the variance of the noise both parts have
chi-square distributions if the model is right.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.calibration.calibration_model import predict_pose_rates
from robsim.calibration.closed_form import estimate_target_poses
from robsim.calibration.model_fit import ModelFit
from robsim.statistics.fisher_distribution import fisher_quantile

CHANCE = 1e-5  # share of calibrations without a fault that are reported, for each part
FAR = 3.0  # pixels: noise that no detector has
OUTLYING = 3.0  # noise of a view, relative to the median view, above which it is left out
EFFICIENCY = 1 / 3  # of the median of views: its degrees of freedom, relative to those of the mean
LEAST = 1e-3  # pixels: smaller residuals are no misfit
RANK = 1e-9  # relative: smaller singular values count as zero


class FitTest(NamedTuple):
    """The residuals of a calibration in relation to the noise.

    Attributes
    ----------
    noise : float
        Standard deviation of a pixel coordinate, given or estimated from each view by itself.
    given : bool
        Whether the noise was given.
    misfit : bool
        Whether the residuals are too large to be noise.
    variance : float
        Variance of a pixel coordinate for the covariance of the estimate, in pixels squared: the
        mean squared residual, or the squared given noise if it is larger. In a misfit it is at
        least the mean square of `lack`.
    freedom : float
        Degrees of freedom of `variance`, infinite for the given noise.
    """

    noise: float
    given: bool
    misfit: bool
    variance: float
    freedom: float


class ResidualPart(NamedTuple):
    """A mean square of residuals with its degrees of freedom."""

    variance: float
    freedom: float

    @classmethod
    def sum_of(cls, squares: float, freedom: float) -> ResidualPart:
        """Return the mean of a sum of squares, NaN without degrees of freedom."""
        return cls(float(squares / freedom) if freedom > 0 else math.nan, float(freedom))

    def exceeds(self, noise: ResidualPart) -> bool:
        """Return whether this part is larger than noise is by chance (Fisher's F test)."""
        if min(self.freedom, noise.freedom) < 1:
            return False
        bound = fisher_quantile(1.0 - CHANCE, self.freedom, noise.freedom)
        return bool(self.variance > bound * noise.variance)


def assess_fit(fit: ModelFit, noise: float | None) -> FitTest:
    """Return the test of a fit against a given noise, or against the noise within the views."""
    squares, freedom = _fit_views_alone(fit)
    within = ResidualPart.sum_of(squares.sum(), freedom.sum())
    total = ResidualPart.sum_of(fit.squares, fit.freedom)
    lack = ResidualPart.sum_of(fit.squares - squares.sum(), fit.freedom - freedom.sum())
    given = [] if noise is None else [ResidualPart(noise**2, math.inf)]
    reference = given[0] if given else _estimate_noise(squares, freedom)
    misfit = fit.rms > LEAST and (
        lack.exceeds(reference) or within.exceeds(reference) or (noise is None and fit.rms > FAR)
    )
    parts = [total, *given, *([lack] if misfit and lack.freedom >= 1 else [])]
    widest = max(parts, key=lambda part: part.variance)
    deviation = math.sqrt(reference.variance)
    return FitTest(deviation, bool(given), misfit, widest.variance, widest.freedom)


def _fit_views_alone(fit: ModelFit) -> tuple[Array, Array]:
    """Return the squared residuals (V,) of views with free poses, and their freedom (V,).

    The parameters of the lens that the fit estimates are estimated here, too, to first order.
    """
    views, camera, scale = fit.views, fit.model.camera, fit.model.scale
    try:
        T = estimate_target_poses(views, camera, scale).T_c_o.matrix
    except InputError:  # a lens through which a view shows no pose
        return _squares_of_views(fit), 2.0 * views.seen.sum(axis=1) - 6.0
    pixels, J = predict_pose_rates(T, scale * views.thing.marks, camera, fit.free.lens)
    seen = np.repeat(views.seen, 2, axis=1)
    r = np.where(seen, (pixels - views.pixels).reshape(len(T), -1), 0.0)
    J = np.where(seen[..., None], J.reshape(*seen.shape, -1), 0.0)
    r, rank = _remove_lens(r, J)
    squares = np.minimum(np.square(r).sum(axis=1), _squares_of_views(fit))
    own = np.maximum(seen.sum(axis=1) - 6.0, 0.0)
    return squares, own * max(1.0 - rank / max(own.sum(), 1.0), 0.0)


def _remove_lens(r: Array, J: Array) -> tuple[Array, int]:
    """Return residuals (V, 2N) after a step of the lens and all poses, and the rank of the lens."""
    Q = np.linalg.qr(J[..., :6])[0]
    Qt = Q.swapaxes(1, 2)
    L = (J[..., 6:] - Q @ (Qt @ J[..., 6:])).reshape(r.size, -1)
    if not L.shape[1]:
        return r, 0
    r = r - (Q @ (Qt @ r[..., None]))[..., 0]
    size = np.sqrt(np.square(L).sum(axis=0))
    L = L / np.where(size > 0.0, size, 1.0)
    step, _, rank, _ = np.linalg.lstsq(L, r.ravel(), rcond=RANK)
    return r - (L @ step).reshape(r.shape), int(rank)


def _squares_of_views(fit: ModelFit) -> Array:
    """Return the squared residuals (V,) of each view in the fit."""
    view = np.repeat(np.argwhere(fit.views.seen)[:, 0], 2)
    return np.bincount(view, fit.residuals**2, len(fit.views)).astype(float)


def _estimate_noise(squares: Array, freedom: Array) -> ResidualPart:
    """Return the noise within the views, without views that are far noisier than the median view.

    The noise of the median view is its sum of squares over the median of chi-square.
    """
    used = freedom > 0
    if not used.any():
        return ResidualPart(math.nan, 0.0)
    each, own = squares[used], freedom[used]
    sizes, which = np.unique(own, return_inverse=True)
    level = 1.0 - CHANCE / len(each)
    medians = np.array([n * fisher_quantile(0.5, n, math.inf) for n in sizes])
    bounds = np.array([fisher_quantile(level, n, EFFICIENCY * own.sum()) for n in sizes])
    middle = np.median(each / medians[which])
    near = each <= own * np.maximum(bounds[which], OUTLYING**2) * middle
    return ResidualPart.sum_of(each[near].sum(), own[near].sum())
