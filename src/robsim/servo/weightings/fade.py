"""The weighting over time, for marks that are hidden and seen again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, PerRun, Time, register
from robsim.kernels.control import mark_weights as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.weightings.weighting_protocol import MarkRows, MarkWeighting


@register("weighting", "fade")
@dataclass(frozen=True)
class Fade(MarkWeighting, DeclaredValue):
    """The weighting by which marks that are hidden or seen again count less or more over a time.

    A mark that is seen again counts in full after `time`. One that is hidden cannot be foreseen:
    it stays where it was seen last, and counts less and less until after the same time it counts
    no more. What is there at the start counts in full.

    >>> Fade(time=0.2).time
    0.2
    """

    fades: ClassVar[bool] = True

    time: Annotated[
        float, Time(above=0), PerRun(()), "Time in which a mark comes to count, or not to."
    ] = 0.5

    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stage of the weights of the marks of a sight, and return their rows."""
        program = of.given.program
        times = {"seconds": program.number(self.time), "dt": of.given.dt}
        ramp = program.rows(of.N)
        return program.result(kernels.fade_weights, "out", of.N, there=of.there, **times, ramp=ramp)
