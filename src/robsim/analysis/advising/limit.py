"""The largest factor of the gains at which a linear loop is stable, and what limits it most."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.advising.linear import Linear
from robsim.analysis.advising.sampled import Matrix, Sampled
from robsim.analysis.advising.scaled import Scaled, mode
from robsim.analysis.advising.timing import Timing
from robsim.analysis.explanation.wording import number
from robsim.base.arrays import Array
from robsim.run.experiment import Experiment

FIRST, LAST = 0.01, 1e9  # rate times delay at the first factor, and the largest factor over it
UP, BLOCK = 1.1, 64  # from one factor that is tried to the next, and how many are at once
LOWER, LOWEST = 0.1, 1e-8  # of the first factor: where even the last is unstable, none is stable
PARTS, CUTS = 33, 4  # of an interval, and how often it is cut
ROUNDS, PER_LOSS = 400, 150.0  # of a power iteration, at least, and times 1/(1 - lost)
NOTABLE = 1.05  # factor by which the limit must rise without a cause


class Maps(NamedTuple):
    """The maps (F, s, s) of the state from one image to the next, at several factors.

    `kept` are those where the image is lost, which a share `lost` is.
    """

    came: Matrix
    kept: Matrix
    lost: float

    def settle(self) -> NDArray[np.bool_]:
        """Return whether (F,) every motion decays, or its mean square where images are lost."""
        if not self.lost:
            return np.asarray(np.abs(np.linalg.eigvals(self.came)).max(axis=-1) < 1.0)
        A, K, p = self.came, self.kept, self.lost
        X: Any = np.broadcast_to(np.eye(A.shape[-1], dtype=A.dtype), A.shape)
        growth, rounds = np.zeros(len(A)), max(ROUNDS, int(PER_LOSS / (1.0 - p)))
        for i in range(rounds):
            X = (1.0 - p) * (A @ X @ _adjoint(A)) + p * (K @ X @ _adjoint(K))
            size = np.trace(X, axis1=-2, axis2=-1).real
            growth += np.log(size) * (i >= rounds // 2)
            X = X / size[:, None, None]
        return np.asarray(growth < 0.0)


Made = Callable[[Array], Maps]  # of factors (F,)


def largest(scaled: Scaled, timing: Timing) -> float:
    """Return the largest factor of the gains below which the loop settles; 0 if there is none.

    It is where an eigenvalue of the map from one image to the next leaves the unit circle. Where
    images are lost, the mean square is to settle, if the command follows from the image alone.
    """
    if scaled.plain:
        return of_modes(scaled.modes, timing)
    short = replace(timing.short, lost=0.0)
    first = _first(list(scaled.rates), short)
    return _limit(lambda factors: _stacked([scaled.at(f, short) for f in factors]), first)


def of_modes(rates: Sequence[complex], timing: Timing) -> float:
    """Return the same of a loop with these rates per second, which are told apart by the image."""
    short = timing.short.held
    if min(rate.real for rate in rates) <= 0.0:
        return 0.0
    first = _first(rates, short)
    return min(_limit(_of_mode(rate, short, first / FIRST), first) for rate in rates)


def settles(loop: Sampled) -> bool:
    """Return whether every motion of a loop decays."""
    return bool(_stacked([loop]).settle()[0])


def _of_mode(rate: complex, timing: Timing, usual: float) -> Made:
    """Return what makes the maps of a mode, which are linear in the factor."""
    none, once = (_stacked([mode(f * rate, timing)]) for f in (0.0, usual))

    def made(factors: Array) -> Maps:
        f = factors[:, None, None] / usual
        came, kept = (a + f * (b - a) for a, b in zip(none[:2], once[:2], strict=True))
        return Maps(came, kept, timing.lost)

    return made


def _stacked(loops: Sequence[Sampled]) -> Maps:
    came, kept = (
        np.stack([loop.steps(lost)[0].of_state for loop in loops]) for lost in (False, True)
    )
    return Maps(came, kept, loops[0].timing.lost)


def _adjoint(A: Matrix) -> Matrix:
    return np.swapaxes(A, -1, -2).conj()


def _first(rates: Sequence[complex], timing: Timing) -> float:
    """Return a factor that is small for these rates."""
    delay = timing.period + timing.latency + timing.lag
    return FIRST / (max(abs(rate) for rate in rates) * delay)


def _limit(made: Made, first: float) -> float:
    """Return the least factor that is not stable, from one that is small."""
    low = first
    while not made(np.array([low])).settle()[0]:
        low *= LOWER
        if low < LOWEST * first:
            return 0.0
    factors: Array = low * UP ** np.arange(BLOCK, dtype=np.float64)
    while (stable := made(factors).settle()).all():
        factors = factors[-1] * UP ** np.arange(BLOCK, dtype=np.float64)
        if factors[0] > LAST * first:
            return float("inf")
    for _ in range(CUTS):
        i = int(np.argmin(stable))  # the first that is not
        factors = np.linspace(float(factors[max(i - 1, 0)]), float(factors[i]), PARTS + 1)
        stable = made(factors).settle()
        stable[-1] = False
    return float(factors[max(int(np.argmin(stable)) - 1, 0)])


def limited_by(experiment: Experiment, linear: Linear, gain: float) -> str:
    """Return what the largest gain would be highest without, in words.

    `gain` is that of the task, at which all motions would decay if all was believed rightly.
    """
    found = sorted(_without(experiment, linear, gain))
    limit = largest(linear.scaled, linear.timing)
    if not found or not found[-1][0] > NOTABLE * limit:
        return f"the control period of {number(1000 * linear.timing.dt)} ms"
    return found[-1][1]


def _without(experiment: Experiment, linear: Linear, gain: float) -> Iterator[tuple[float, str]]:
    """Yield the largest factors of the gain without each cause."""
    for part in ("sensing", "actuation"):
        holder = getattr(experiment, part)
        for each in holder.acting():
            left = Timing.of(experiment.with_(**{part: each.removed(holder)}))
            if left != linear.timing:
                yield largest(linear.scaled, left), each.effect.cause(experiment.dt)
    if math.isfinite(gain):
        yield of_modes([gain], linear.timing), "what is believed, or the law"
