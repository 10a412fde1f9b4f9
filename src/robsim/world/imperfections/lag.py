"""The lag of joints behind their command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.declare import PerRun, Time, register
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.joint_effect import JointEffect, JointEffectStage, JointResponse

LagTime = Annotated[
    float,
    Time(least=0),
    PerRun((), above=0.0),
    "Time constant of the first-order response v' = (command - v)/lag.",
]


@register("joint effect", "lag")
@dataclass(frozen=True)
class Lag(JointEffect):
    """A first-order response of the joints to their command.

    With a gain k of the task the loop has the damping ratio 1 / (2 sqrt(lag k)); it oscillates if
    this ratio is below 1.

    Examples
    --------
    >>> Lag(0.1).cause(0.04)
    'a lag of 100 ms'
    """

    place: ClassVar[JointEffectStage] = JointEffectStage.FOLLOWED
    title: ClassVar[str] = "the lag of the joints"
    lag: LagTime = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_milliseconds(self.lag, "Lag.lag")

    def response(self, count: int) -> JointResponse:
        return JointResponse.of(count, self.lag)

    def cause(self, dt: float) -> str:
        return f"a lag of {1000 * self.lag:.3g} ms"

    def stated(self, facts: RunFacts) -> Statement:
        damping = 0.5 / np.sqrt(self.lag * facts.gain)
        sentence = f"The joints follow their command with a lag of {self.lag:.3g} s"
        if np.isfinite(damping):
            sentence += (
                f": at a gain of {facts.gain:.3g} per second the damping ratio of the loop is "
                f"{damping:.3g}, and below 1 it oscillates"
            )
        numbers = {"lag_s": self.lag, "gain": facts.gain, "damping": float(damping)}
        return f"{sentence}.", numbers
