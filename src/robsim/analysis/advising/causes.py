"""What limits the gain of a loop most: an imperfection, the control period, or a belief."""

from __future__ import annotations

import math
from collections.abc import Iterator

from robsim.analysis.advising.limit import largest, of_modes
from robsim.analysis.advising.linear import Linear
from robsim.analysis.advising.timing import Timing
from robsim.analysis.explanation.wording import number
from robsim.run.experiment import Experiment

NOTABLE = 1.05  # factor by which the limit must rise without a cause


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
