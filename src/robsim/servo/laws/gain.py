"""Gains: one number, or one that grows as the error or the command gets smaller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, KindOf, Number, Word, family, register
from robsim.kernels.formulas import adaptive_gain as kernels

PER_SECOND = Number(above=0, unit="per second")
GAINS = family("gain")
GainArgument = Literal["error", "command"]  # what a gain can depend on


@register("gain", "adaptive")
@dataclass(frozen=True)
class AdaptiveGain(DeclaredValue):
    """A gain that is low far from the goal, for gentle starts, and high near it.

    gain(x) = (at_zero - at_infinity) exp(-slope x/(at_zero - at_infinity)) + at_infinity
    (Kermorgant and Chaumette 2014, "Dealing with constraints in sensor-based robot control").
    What x is, `of` says: of the "error" the 2-norm of e, in its own unit; of the "command" the
    largest component of the joint velocities that the law commands at a gain of one per second,
    without feed-forward, as in ViSP: max |L^+ e| of a free camera, in m and rad. InputError unless
    at_zero is above at_infinity.

    >>> gain = AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)
    >>> gain.at(np.array([0.0, 0.1, 10.0])).round(3)
    array([4.   , 1.965, 0.4  ])
    """

    at_zero: Annotated[float, PER_SECOND, "The gain at x = 0."]
    at_infinity: Annotated[float, PER_SECOND, "The gain far from the goal, the smaller one."]
    slope: Annotated[
        float, Number(above=0), "Minus the derivative at x = 0, per second and unit of x."
    ]
    of: Annotated[
        GainArgument,
        Word(get_args(GainArgument), "size"),
        "On what it depends: the size of the error, or that of the command at a gain of one.",
    ] = "error"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.at_zero <= self.at_infinity:
            raise InputError(
                "an adaptive gain falls as the error grows: at_zero must be above at_infinity, "
                f"got {self.at_zero} and {self.at_infinity}"
            )

    def at(self, size: Array) -> Array:
        """Return the gains (..., B) per second at sizes (..., B) of the error or the command."""
        given = as_floats(size, "size", ("B",))
        if (given < 0).any():
            raise InputError(f"size: a length is not below 0, got {given.min():g}")
        gain = np.empty(given.size)
        kernels.compute_gains(self.at_zero, self.at_infinity, self.slope, given.ravel(), gain)
        return gain.reshape(given.shape)

    @property
    def least(self) -> float:
        """The smallest gain, per second, which is that of a large error."""
        return self.at_infinity


GAIN = KindOf(GAINS, default="adaptive", short=False, other=PER_SECOND)
