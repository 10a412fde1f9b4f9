"""Latency: the age of images when they are used."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.declare import PerRun, Time, register
from robsim.world.imperfections.image_effect import ImageEffect, ImageEffectStage, ImageTiming
from robsim.world.imperfections.imperfection import RunFacts, Statement

ImageLatency = Annotated[
    float, Time(least=0), PerRun(()), "Age of an image when the controller uses it."
]


@register("image effect", "latency")
@dataclass(frozen=True)
class Latency(ImageEffect):
    """A delay from the exposure of images until their use.

    The delay lowers the largest stable gain, see `delay_limit`.

    Examples
    --------
    >>> Latency(0.04).cause(0.02)
    '40 ms of latency'
    """

    place: ClassVar[ImageEffectStage] = ImageEffectStage.TAKEN
    title: ClassVar[str] = "latency"
    latency: ImageLatency = 0.06

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_milliseconds(self.latency, "Latency.latency")

    def timing(self, dt: float) -> ImageTiming:
        return ImageTiming(latency=self.latency)

    def cause(self, dt: float) -> str:
        return f"{1000 * self.latency:.3g} ms of latency"

    def stated(self, facts: RunFacts) -> Statement:
        periods = self.latency / facts.dt
        limit, product = delay_limit(periods), facts.gain * facts.dt
        sentence = f"The images are {self.latency:.3g} s old, {facts.in_periods(self.latency)}"
        if product > limit:
            sentence += (
                f": with such a delay the loop is unstable if gain times period exceeds "
                f"{limit:.3g}, and it is {product:.3g}"
            )
        elif product <= limit:
            sentence += f"; gain times period is {product:.3g}, and {limit:.3g} is the limit"
        numbers = {"periods": periods, "gain_dt": product, "limit": limit, "gain": facts.gain}
        return f"{sentence}.", numbers


def delay_limit(periods: float) -> float:
    """Return the largest stable product of gain and period for an error delayed by some periods.

    For m whole periods and a fraction f, the characteristic equation of the loop is

        z^(m+2) - z^(m+1) + gain dt ((1 - f) z + f) = 0.

    At the limit, two of its roots reach the unit circle, at the angles +-w. Without a fraction, the
    limit is 2 sin(pi / (2 (2 m + 1))).

    >>> [round(delay_limit(d), 3) for d in (0, 1, 2, 2.5, 3)]
    [2.0, 1.0, 0.618, 0.536, 0.445]
    """
    m, w = math.floor(periods + 1e-9), math.pi
    f = max(periods - m, 0.0)
    for _ in range(100):  # contracts by less than 2/3 each time
        between = (1.0 - f) * cmath.exp(1j * w) + f
        w = (math.pi / 2 + cmath.phase(between)) / (m + 1.5)
    return 2.0 * math.sin(w / 2) / abs(between)
