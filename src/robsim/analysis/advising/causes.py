"""What limits the gain of a loop most: latency, rare or lost images, lag, or what is believed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from robsim.analysis.advising.limit import largest, of_modes
from robsim.analysis.advising.linear import Linear
from robsim.analysis.explanation.wording import number

NOTABLE = 1.05  # factor by which the limit must rise without a cause


def limited_by(linear: Linear, gain: float) -> str:
    """Return what the largest gain would be highest without, in words.

    `gain` is that of the task, at which all motions would decay if all was believed rightly.
    """
    found = sorted(_without(linear, gain))
    limit = largest(linear.scaled, linear.timing)
    if not found or not found[-1][0] > NOTABLE * limit:
        return f"the control period of {_ms(linear.timing.dt)}"
    return found[-1][1]


def _without(linear: Linear, gain: float) -> Iterator[tuple[float, str]]:
    """Yield the largest factors of the gain without each cause."""
    t = linear.timing
    causes = (
        (t.latency, {"latency": 0.0}, f"{_ms(t.latency)} of latency"),
        (t.every > 1, {"every": 1}, f"images every {_ms(t.period)}"),
        (t.lag, {"lag": 0.0}, f"a lag of {_ms(t.lag)}"),
        (t.lost, {"lost": 0.0}, f"{number(100 * t.lost)} % of lost images"),
    )
    for there, change, text in causes:
        if there:
            yield largest(linear.scaled, replace(t, **change)), text
    if math.isfinite(gain):
        yield of_modes([gain], t), "what is believed, or the law"


def _ms(seconds: float) -> str:
    return f"{number(1000 * seconds)} ms"
