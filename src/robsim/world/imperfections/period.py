"""The period of a camera that is slower than the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.declare import Time, register
from robsim.world.imperfections.image_effect import ImageEffect, ImageEffectStage, ImageTiming
from robsim.world.imperfections.imperfection import RunFacts, Statement

MOST_PERIODS = 1e15  # control periods; a longer period means that no second image follows
CameraPeriodTime = Annotated[
    float | None,
    Time(above=0),
    "Time from one image to the next, a multiple of the control period. None: one period.",
]


@register("image effect", "period")
@dataclass(frozen=True)
class CameraPeriod(ImageEffect):
    """Images that arrive every few control periods; the command is held in between.

    Examples
    --------
    >>> CameraPeriod(0.08).timing(0.04).every
    2
    """

    place: ClassVar[ImageEffectStage] = ImageEffectStage.TAKEN
    title: ClassVar[str] = "rare images"
    left_out: ClassVar[str] = ""
    period: CameraPeriodTime

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_milliseconds(self.period, "CameraPeriod.period")

    def timing(self, dt: float) -> ImageTiming:
        """Return the timing of images; raise InputError unless they come after whole periods."""
        if self.period is None:
            return ImageTiming()
        ratio = min(self.period / dt, MOST_PERIODS)
        if not round(ratio) >= 1 or abs(ratio - round(ratio)) > 1e-6:
            raise InputError(
                f"the period of the camera, {self.period:g} s, must be a multiple of the control "
                f"period, {dt:g} s"
            )
        return ImageTiming(every=round(ratio))

    def cause(self, dt: float) -> str:
        return f"images every {1000 * dt * self.timing(dt).every:.3g} ms"

    def stated(self, facts: RunFacts) -> Statement:
        seconds = self.period or facts.dt
        product = facts.gain * seconds
        sentence = (
            f"A new image comes every {seconds:.3g} s only, {facts.in_periods(seconds)}, "
            "and the command is held in between"
        )
        if np.isfinite(product):
            sentence += (
                f": gain times {seconds:.3g} s is {product:.3g}, and from 2 on the loop is unstable"
            )
        return f"{sentence}.", {"period_s": seconds, "gain_period": product, "limit": 2.0}
