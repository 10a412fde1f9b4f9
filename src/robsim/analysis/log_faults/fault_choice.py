"""The choice of the fault that explains recorded signals: the least BIC."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robsim.analysis.log_faults.hypothesis import Hypothesis, HypothesisFit, fit_hypothesis
from robsim.base.arrays import Array

GAP = 20.0  # difference of BIC above which one hypothesis is preferred to another
EQUAL = 1.0  # difference of n ln(s^2) below which two hypotheses fit equally well
FEWEST = 8.0  # least number of independent samples


@dataclass(frozen=True, eq=False)
class FaultChoice:
    """The fits of some hypotheses to the same signals, with their criteria.

    The first fit is the robot without a fault.
    """

    fits: tuple[HypothesisFit, ...]
    criteria: tuple[float, ...]
    samples: float  # number of independent residuals
    floor: float

    @property
    def healthy(self) -> HypothesisFit:
        """The fit of the robot without a fault."""
        return self.fits[0]

    @property
    def best(self) -> HypothesisFit:
        """The fit with the least criterion."""
        return self.fits[int(np.argmin(self.criteria))]

    @property
    def gap(self) -> float:
        """The criterion without a fault minus the least criterion."""
        return self.criteria[0] - min(self.criteria)

    @property
    def has_fault(self) -> bool:
        """Whether a fault large enough to be reported explains the signals better."""
        return self.gap > GAP and self.best.hypothesis.size(self.best.values) >= 1.0

    @cached_property
    def group(self) -> tuple[HypothesisFit, ...]:
        """The faults that the signals do not separate from the best, each once, the best first.

        Their criteria are within GAP of the least, or they have more numbers and fit as well.
        """
        least = min(self.criteria)
        near = [
            fit
            for fit, value in self._ranked
            if fit is self.best or self._is_alternative(fit, value - least)
        ]
        return tuple({fit.hypothesis.name: fit for fit in reversed(near)}.values())[::-1]

    def _is_alternative(self, fit: HypothesisFit, behind: float) -> bool:
        n = math.log(self.samples)
        extra = n * (fit.hypothesis.count - self.best.hypothesis.count)
        near = behind < GAP or behind - extra < EQUAL
        return near and fit is not self.healthy and not fit.hypothesis.is_pair

    @property
    def next(self) -> tuple[HypothesisFit, float]:
        """The best fit outside the group, and the distance of its criterion from the least.

        Pairs of faults that include the best are no competitors.
        """
        names = {fit.hypothesis.name for fit in self.group}
        others = [
            each
            for each in self._ranked
            if each[0].hypothesis.name not in names and not each[0].hypothesis.is_pair
        ]
        fit, value = others[0]
        return fit, value - min(self.criteria)

    def describe(self, fit: HypothesisFit) -> str:
        """Return the clause on a fault with its numbers, their intervals and its path."""
        half = fit.compute_half_widths(self.samples, self.floor)
        path = f" ({fit.hypothesis.path})" if fit.hypothesis.path else ""
        return fit.hypothesis.describe(fit.values, half) + path

    @property
    def _ranked(self) -> list[tuple[HypothesisFit, float]]:
        """The fits with their criteria, the least first."""
        return sorted(zip(self.fits, self.criteria, strict=True), key=lambda each: each[1])


def choose_fault(hypotheses: Sequence[Hypothesis], observed: Array, floor: float) -> FaultChoice:
    """Return the choice among hypotheses, the first without a fault, for observed signals (T, M).

    `floor` is the standard deviation of errors of the model, which no hypothesis can undercut.
    Correlated residuals count as fewer samples: of n residuals with the correlation r of
    neighbours in time, n (1 - r)/(1 + r) are independent (Bayley and Hammersley 1946).
    """
    fits = tuple(fit_hypothesis(each, observed) for each in hypotheses)
    count = float(np.isfinite(observed).sum())
    best = min(fits, key=lambda each: each.compute_criterion(count, floor))
    r = best.correlate_neighbours(floor)
    samples = max(count * (1.0 - r) / (1.0 + r), min(FEWEST, count))
    criteria = tuple(each.compute_criterion(samples, floor) for each in fits)
    return FaultChoice(fits, criteria, samples, floor)
