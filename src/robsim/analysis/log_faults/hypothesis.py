"""A hypothesis on the fault of a robot, and its fit to recorded signals by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.statistics.least_squares import LeastSquaresProblem, minimise, triangular_factor

FAR = 1e3  # residual of a signal without a prediction, such as a mark behind the camera
ARRIVED, SHARE = 1e-4, 1e-3  # norm of the change of residuals, and its share, that end a fit
STEP = 1e-6  # finite difference of a number; numbers are in rad, m, s, or are factors
COVERAGE = 1.96  # standard deviations of the half width of a 95 % interval
NORMAL_QUARTILE = 0.6745  # median of |x| of a standard normal x
RANK = 1e-9  # relative: smaller singular values of the scaled Jacobian count as zero


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A possible fault with unknown numbers, and the signals that it predicts.

    Attributes
    ----------
    about : str
        Kind of the fault, such as "focal length".
    part : str
        Name of the camera, target or joint; "" for all.
    predict : callable
        Signals (T, M) for numbers (P,); NaN for a signal that cannot be predicted.
    describe : callable
        Clause on the fault, from its numbers (P,) and the half widths (P,) of their intervals.
    names : tuple of str
        Names of the numbers, for the evidence of a finding.
    starts : array_like of shape (S, P)
        First values of the numbers; the best of them is taken.
    size : callable, optional
        Size of the fault in units of the smallest size that is reported. Default: 1.
    cost : int
        Numbers chosen without a fit, such as a pair of joints, which count in the criterion.
    path : str
        Path of the numbers in an experiment, such as "cameras.eye.focal"; "" without one.
    correct : callable, optional
        True coordinates (T, nq) from measured coordinates and the numbers, for a fault of readings.
    is_pair : bool
        Whether two faults are combined, so that the hypothesis is no alternative to one of them.
    """

    about: str
    part: str
    predict: Callable[[Array], Array]
    describe: Callable[[Array, Array], str]
    names: tuple[str, ...] = ()
    starts: Sequence[Sequence[float]] = ((),)
    size: Callable[[Array], float] = field(default=lambda values: 1.0)
    cost: int = 0
    path: str = ""
    correct: Callable[[Array, Array], Array] | None = None
    is_pair: bool = False

    @property
    def name(self) -> tuple[str, str]:
        """The kind and the part of the fault."""
        return self.about, self.part

    @property
    def count(self) -> int:
        """The number of parameters in the criterion."""
        return len(self.names) + self.cost


@dataclass(frozen=True, eq=False)
class HypothesisFit:
    """The numbers (P,) of a hypothesis with the least squares, and the residuals (T, M)."""

    hypothesis: Hypothesis
    values: Array
    residuals: Array  # NaN where nothing was observed

    @property
    def squares(self) -> float:
        """The sum of the squared residuals."""
        return float(np.nansum(self.residuals**2))

    @property
    def rms(self) -> float:
        """The root mean square of the residuals."""
        return float(np.sqrt(np.nanmean(self.residuals**2)))

    def compute_criterion(self, samples: float, floor: float) -> float:
        """Return BIC = n ln(s^2) + P ln n for n samples of residuals with the variance s^2.

        The variance includes the square of `floor`, the error of the model (Schwarz 1978).
        """
        variance = float(np.nanmean(self.residuals**2)) + floor**2
        return samples * float(np.log(variance)) + self.hypothesis.count * float(np.log(samples))

    def compute_half_widths(self, samples: float, floor: float) -> Array:
        """Return the half widths (P,) of the 95 % intervals, infinite if undetermined.

        The covariance is s^2 (J'J)^-1 with the variance s^2 of the residuals, which includes the
        square of `floor`. It is larger by the share of residuals that are not independent.
        """
        if not len(self.values):
            return np.empty(0)
        seen = np.isfinite(self.residuals)
        begin = self.hypothesis.predict(self.values)[seen]
        J = _compute_rates(self.hypothesis, seen, self.values, begin)
        scale = np.sqrt(np.square(J).sum(axis=0))
        if not (np.isfinite(J).all() and (scale > 0.0).all()):
            return np.full(len(self.values), np.inf)
        _, s, Vt = np.linalg.svd(triangular_factor(J / scale))
        if s[-1] <= RANK * s[0]:
            return np.full(len(self.values), np.inf)
        variance = float(np.nanmean(self.residuals**2)) + floor**2
        variance *= float(seen.sum()) / samples
        half = Vt.T / s / scale[:, None]
        return np.asarray(COVERAGE * np.sqrt(variance * np.square(half).sum(axis=1)))

    def estimate_noise(self) -> float:
        """Return the standard deviation of white noise, robustly from second differences in time.

        They have six times its variance, and are small for errors that vary slowly.
        """
        curvature = np.diff(self.residuals, 2, axis=0)
        size = np.abs(curvature[np.isfinite(curvature)])
        return float(np.median(size)) / (NORMAL_QUARTILE * math.sqrt(6.0)) if size.size else 0.0

    def correlate_neighbours(self, floor: float) -> float:
        """Return the correlation of successive residuals in time, at least zero.

        Errors of the size `floor` count as independent.
        """
        now, after = self.residuals[:-1], self.residuals[1:]
        both = np.isfinite(now) & np.isfinite(after)
        power = float(np.sqrt((now[both] ** 2).sum() * (after[both] ** 2).sum()))
        power += floor**2 * float(both.sum())
        return max(float((now[both] * after[both]).sum()) / power, 0.0) if power else 0.0


def fit_hypothesis(hypothesis: Hypothesis, observed: Array) -> HypothesisFit:
    """Return the fit of a hypothesis to observed signals (T, M), NaN where nothing was observed."""
    seen = np.isfinite(observed)
    known: dict[bytes, Array] = {}  # the last prediction, at which the Jacobian is computed

    def predict(values: Array) -> Array:
        key = values.tobytes()
        if key not in known:
            known.clear()
            known[key] = hypothesis.predict(values)[seen]
        return known[key]

    def residuals(values: Array) -> Array:
        r = predict(values) - observed[seen]
        return np.where(np.isfinite(r), r, FAR)

    def rates(values: Array) -> Array:
        begin = predict(values)
        return np.nan_to_num(_compute_rates(hypothesis, seen, values, begin))

    starts = [np.array(each, dtype=float) for each in hypothesis.starts]
    values = min(starts, key=lambda each: float((residuals(each) ** 2).sum()))
    if len(values):
        problem = LeastSquaresProblem(residuals, rates, lambda state, step: state + step)
        values = minimise(problem, values, arrived=ARRIVED, share=SHARE)
    table = np.full(observed.shape, np.nan)
    table[seen] = residuals(values)
    return HypothesisFit(hypothesis, values, table)


def _compute_rates(
    hypothesis: Hypothesis, seen: NDArray[np.bool_], values: Array, begin: Array
) -> Array:
    """Return the Jacobian (M, P) of the predictions `begin` (M,) by forward differences."""
    steps = values + STEP * np.eye(len(values))
    ends = [hypothesis.predict(each)[seen] for each in steps]
    return np.stack([(end - begin) / STEP for end in ends], axis=1)
