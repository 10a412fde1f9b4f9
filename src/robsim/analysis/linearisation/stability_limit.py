"""The largest factor of the gains at which a linear loop is stable, and what limits it most."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.linearisation.discrete_loop import DiscreteLoop, Matrix
from robsim.analysis.linearisation.gain_dependence import GainDependence, make_mode_loop
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.base.arrays import Array
from robsim.run.experiment import Experiment

FIRST, LAST = 0.01, 1e9  # rate times delay at the first factor, and the largest factor over it
UP, BLOCK = 1.1, 64  # from one factor that is tried to the next, and how many are at once
LOWER, LOWEST = 0.1, 1e-8  # of the first factor: where even the last is unstable, none is stable
PARTS, CUTS = 33, 4  # of an interval, and how often it is cut
ROUNDS, PER_LOSS = 400, 150.0  # of a power iteration, at least, and times 1/(1 - lost)
NOTABLE_RISE = 1.05  # factor by which the limit must rise without a cause


class StateMaps(NamedTuple):
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
            X = (1.0 - p) * (A @ X @ _conjugate_transpose(A)) + p * (
                K @ X @ _conjugate_transpose(K)
            )
            size = np.trace(X, axis1=-2, axis2=-1).real
            growth += np.log(size) * (i >= rounds // 2)
            X = X / size[:, None, None]
        return np.asarray(growth < 0.0)


MapBuilder = Callable[[Array], StateMaps]  # of factors (F,)


def find_largest_factor(scaled: GainDependence, timing: LoopDelays) -> float:
    """Return the largest factor of the gains below which the loop settles; 0 if there is none.

    It is where an eigenvalue of the map from one image to the next leaves the unit circle. Where
    images are lost, the mean square is to settle, if the command follows from the image alone.
    """
    if scaled.plain:
        return find_mode_limit(scaled.modes, timing)
    short = replace(timing.short, lost=0.0)
    first = _small_factor(list(scaled.rates), short)
    return _search_limit(lambda factors: _stack_maps([scaled.at(f, short) for f in factors]), first)


def find_mode_limit(rates: Sequence[complex], timing: LoopDelays) -> float:
    """Return the same of a loop with these rates per second, which are told apart by the image."""
    short = timing.short.held
    if min(rate.real for rate in rates) <= 0.0:
        return 0.0
    first = _small_factor(rates, short)
    return min(
        _search_limit(_make_mode_builder(rate, short, first / FIRST), first) for rate in rates
    )


def is_stable(loop: DiscreteLoop) -> bool:
    """Return whether every motion of a loop decays."""
    return bool(_stack_maps([loop]).settle()[0])


def _make_mode_builder(rate: complex, timing: LoopDelays, usual: float) -> MapBuilder:
    """Return what makes the maps of a mode, which are linear in the factor."""
    none, once = (_stack_maps([make_mode_loop(f * rate, timing)]) for f in (0.0, usual))

    def made(factors: Array) -> StateMaps:
        f = factors[:, None, None] / usual
        came, kept = (a + f * (b - a) for a, b in zip(none[:2], once[:2], strict=True))
        return StateMaps(came, kept, timing.lost)

    return made


def _stack_maps(loops: Sequence[DiscreteLoop]) -> StateMaps:
    came, kept = (
        np.stack([loop.steps(lost)[0].of_state for loop in loops]) for lost in (False, True)
    )
    return StateMaps(came, kept, loops[0].timing.lost)


def _conjugate_transpose(A: Matrix) -> Matrix:
    return np.swapaxes(A, -1, -2).conj()


def _small_factor(rates: Sequence[complex], timing: LoopDelays) -> float:
    """Return a factor that is small for these rates."""
    delay = timing.period + timing.latency + timing.lag
    return FIRST / (max(abs(rate) for rate in rates) * delay)


def _search_limit(made: MapBuilder, first: float) -> float:
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


def find_limiting_cause(experiment: Experiment, linear: LinearLoop, gain: float) -> str:
    """Return what the largest gain would be highest without, in words.

    `gain` is that of the task, at which all motions would decay if all was believed rightly.
    """
    found = sorted(_limits_without_causes(experiment, linear, gain))
    limit = find_largest_factor(linear.scaled, linear.timing)
    if not found or not found[-1][0] > NOTABLE_RISE * limit:
        return f"the control period of {format_number(1000 * linear.timing.dt)} ms"
    return found[-1][1]


def _limits_without_causes(
    experiment: Experiment, linear: LinearLoop, gain: float
) -> Iterator[tuple[float, str]]:
    """Yield the largest factors of the gain without each cause."""
    for part in ("sensing", "actuation"):
        holder = getattr(experiment, part)
        for each in holder.acting():
            left = LoopDelays.of(experiment.with_(**{part: each.removed(holder)}))
            if left != linear.timing:
                yield find_largest_factor(linear.scaled, left), each.effect.cause(experiment.dt)
    if math.isfinite(gain):
        yield find_mode_limit([gain], linear.timing), "what is believed, or the law"
