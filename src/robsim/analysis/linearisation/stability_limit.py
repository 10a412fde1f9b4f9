"""The largest stable factor of the gains of a linear loop, and its main cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.linearisation.discrete_loop import DiscreteLoop
from robsim.analysis.linearisation.gain_dependence import GainDependence, make_mode_loop
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.linear_plant import Matrix
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.base.arrays import Array
from robsim.run.experiment import Experiment

if TYPE_CHECKING:  # few loops have drives
    from robsim.analysis.linearisation.driven_loop import DrivenLoop

FIRST, LAST = 0.01, 1e9  # rate times delay at the first factor; largest factor over the first
UP, BLOCK = 1.1, 64  # ratio of consecutive factors, and number of factors tested at once
LOWER, LOWEST = 0.1, 1e-8  # ratio of falling factors; least factor over the first
PARTS, CUTS = 33, 4  # parts of an interval, and number of subdivisions
ROUNDS, PER_LOSS = 400, 150.0  # least rounds of a power iteration, and rounds times (1 - lost)
NUDGE = 1e-3  # relative change of a factor, for differences
NOTABLE_RISE = 1.05  # least ratio of the limits without and with a cause


class StateMaps(NamedTuple):
    """Maps (F, s, s) of the state from one image to the next, at several factors of the gains.

    `arrival_map` are the maps for images that arrive, and `lost_map` the maps for lost images, with
    the previous image used again. `lost` is the share of lost images.
    """

    arrival_map: Matrix
    lost_map: Matrix
    lost: float

    def is_stable(self) -> NDArray[np.bool_]:
        """Return whether (F,) all motions decay, in the mean square if images are lost."""
        if not self.lost:
            return np.asarray(np.abs(np.linalg.eigvals(self.arrival_map)).max(axis=-1) < 1.0)
        A, K, p = self.arrival_map, self.lost_map, self.lost
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
    """Return the largest factor of the gains below which the loop is stable; 0 if there is none.

    At this factor an eigenvalue of the map from one image to the next leaves the unit circle. With
    lost images the mean square is used if the command depends on the image alone.
    """
    if scaled.is_image_only:
        return find_mode_limit(scaled.modes, timing)
    short = replace(timing.with_rarer_images, lost=0.0)
    first = _small_factor(list(scaled.rates), short)
    return _search_limit(lambda factors: _stack_maps([scaled.at(f, short) for f in factors]), first)


def find_loop_limit(linear: LinearLoop, timing: LoopDelays | None = None) -> float:
    """Return the largest factor of the gains of a loop, with its drives if there are any.

    `timing` replaces the delays of the loop. Lost images are not considered with a drive.
    """
    times = linear.timing if timing is None else timing
    if linear.driven is None:
        return find_largest_factor(linear.gain_dependence, times)
    return find_driven_limit(linear.driven, times, linear.gain_dependence.rates)


def find_driven_limit(
    driven: DrivenLoop, timing: LoopDelays, rates: Sequence[complex] | Array
) -> float:
    """Return the largest factor of the gains of a loop with drives."""
    short = replace(timing.with_rarer_images, lost=0.0)
    first = _small_factor(list(rates), short)
    return _search_limit(lambda factors: _stack_maps([driven.at(f, short) for f in factors]), first)


def estimate_limit_change(
    driven: DrivenLoop, perturbed: DrivenLoop, timing: LoopDelays, limit: float
) -> float:
    """Return the relative change of the largest factor of a perturbed loop, of first order.

    The largest modulus of the eigenvalues at the limit changes by the perturbation as much as by a
    change of the factor.
    """
    short = timing.with_rarer_images
    factors = limit * (1.0 + NUDGE), limit * (1.0 - NUDGE), limit
    above, below, here = (_spectral_radius(driven.at(f, short)) for f in factors)
    other = _spectral_radius(perturbed.at(limit, short))
    slope = (above - below) / (2.0 * NUDGE)
    return (here - other) / slope if slope > 0.0 else 0.0


def _spectral_radius(loop: DiscreteLoop) -> float:
    """Return the largest modulus of the eigenvalues of the map from one image to the next."""
    return float(np.abs(np.linalg.eigvals(loop.steps()[0].of_state)).max())


def find_mode_limit(rates: Sequence[complex], timing: LoopDelays) -> float:
    """Return the largest factor of the gains for independent modes with these rates in 1/s."""
    short = timing.with_rarer_images.per_image
    if min(rate.real for rate in rates) <= 0.0:
        return 0.0
    first = _small_factor(rates, short)
    return min(
        _search_limit(_make_mode_builder(rate, short, first / FIRST), first) for rate in rates
    )


def is_stable(loop: DiscreteLoop) -> bool:
    """Return whether every motion of a loop decays."""
    return bool(_stack_maps([loop]).is_stable()[0])


def _make_mode_builder(rate: complex, timing: LoopDelays, usual: float) -> MapBuilder:
    """Return a function from factors to the maps of one mode, which are linear in the factor."""
    none, once = (_stack_maps([make_mode_loop(f * rate, timing)]) for f in (0.0, usual))

    def build_maps(factors: Array) -> StateMaps:
        f = factors[:, None, None] / usual
        used_map, lost_map = (a + f * (b - a) for a, b in zip(none[:2], once[:2], strict=True))
        return StateMaps(used_map, lost_map, timing.lost)

    return build_maps


def _stack_maps(loops: Sequence[DiscreteLoop]) -> StateMaps:
    """Return the maps of several loops in one array."""
    used_map, lost_map = (
        np.stack([loop.steps(lost)[0].of_state for loop in loops]) for lost in (False, True)
    )
    return StateMaps(used_map, lost_map, loops[0].timing.lost)


def _conjugate_transpose(A: Matrix) -> Matrix:
    """Return the conjugate transpose."""
    return np.swapaxes(A, -1, -2).conj()


def _small_factor(rates: Sequence[complex], timing: LoopDelays) -> float:
    """Return a factor that is small for these rates."""
    delay = timing.period + timing.latency + timing.lag
    return FIRST / (max(abs(rate) for rate in rates) * delay)


def _search_limit(builder: MapBuilder, first: float) -> float:
    """Return the largest stable factor, searched upward from the small factor `first`.

    The result is 0 if no factor is stable, and infinite if all are.
    """
    low = first
    while not builder(np.array([low])).is_stable()[0]:
        low *= LOWER
        if low < LOWEST * first:
            return 0.0
    factors: Array = low * UP ** np.arange(BLOCK, dtype=np.float64)
    while (stable := builder(factors).is_stable()).all():
        factors = factors[-1] * UP ** np.arange(BLOCK, dtype=np.float64)
        if factors[0] > LAST * first:
            return float("inf")
    for _ in range(CUTS):
        i = int(np.argmin(stable))  # the first unstable factor
        factors = np.linspace(float(factors[max(i - 1, 0)]), float(factors[i]), PARTS + 1)
        stable = builder(factors).is_stable()
        stable[-1] = False
    return float(factors[max(int(np.argmin(stable)) - 1, 0)])


def find_limiting_cause(experiment: Experiment, linear: LinearLoop, gain: float) -> str:
    """Return the main cause of the largest gain: without it the limit would be the highest.

    `gain` is the gain of the task, the decay rate of all motions under true beliefs.
    """
    limits = sorted(_limits_without_causes(experiment, linear, gain))
    limit = find_loop_limit(linear)
    if not limits or not limits[-1][0] > NOTABLE_RISE * limit:
        return f"the control period of {format_number(1000 * linear.timing.dt)} ms"
    return limits[-1][1]


def _limits_without_causes(
    experiment: Experiment, linear: LinearLoop, gain: float
) -> Iterator[tuple[float, str]]:
    """Yield the largest factor of the gains without each cause, and the name of the cause."""
    for part in ("sensing", "actuation"):
        holder = getattr(experiment, part)
        for each in holder.list_active():
            timing = LoopDelays.of(experiment.with_(**{part: each.remove_from(holder)}))
            if timing != linear.timing:
                yield (find_loop_limit(linear, timing), each.effect.cause(experiment.dt))
    if math.isfinite(gain):
        yield _limit_with_true_law(linear, gain), "wrong beliefs, or the law"
    if linear.driven is not None and linear.drives is not None:
        from robsim.analysis.linearisation.driven_loop import idealise_joints

        all_joints = range(len(linear.drives.joints.names))
        ideal = idealise_joints(linear.driven, linear.drives, all_joints)
        rates = linear.gain_dependence.rates
        label = f"the drive {linear.drives.joints.drive.label}"
        yield find_driven_limit(ideal, linear.timing, rates), label


def _limit_with_true_law(linear: LinearLoop, gain: float) -> float:
    """Return the largest factor of the gains if all motions decay at the rate `gain`."""
    if linear.driven is None:
        return find_mode_limit([gain], linear.timing)
    n = linear.field.n
    true = linear.driven.with_image_part(-gain * linear.driven.basis[:n])
    return find_driven_limit(true, linear.timing, [complex(gain)])
