"""Gains: a constant, or a function that grows as the error gets smaller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Choice, Declared, Number, family, register
from robsim.kernels import gain as kernels

PER_SECOND = Number(above=0, unit="per second")
GAINS = family("gain")


@register("gain", "adaptive")
@dataclass(frozen=True)
class AdaptiveGain(Declared):
    """A gain that is low for large errors, for gentle starts, and high near the goal.

    gain(x) = (at_zero - at_infinity) exp(-slope x/(at_zero - at_infinity)) + at_infinity, with x
    the 2-norm of e in its own unit (Kermorgant and Chaumette 2014, "Dealing with constraints in
    sensor-based robot control").

    >>> gain = AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)
    >>> gain.of(np.array([0.0, 0.1, 10.0])).round(3)
    array([4.   , 1.965, 0.4  ])
    """

    at_zero: Annotated[float, PER_SECOND, "Gain at e = 0."]
    at_infinity: Annotated[float, PER_SECOND, "Gain for large errors, which is below at_zero."]
    slope: Annotated[
        float,
        Number(above=0),
        "Minus the derivative of the gain at e = 0, per second and unit of e.",
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.at_zero <= self.at_infinity:
            raise InputError(
                "an adaptive gain falls as the error grows: at_zero must be above at_infinity, "
                f"got {self.at_zero} and {self.at_infinity}"
            )

    def of(self, norm: Array) -> Array:
        """Return the gain (B,) per second at norms (B,) of the error."""
        gain = np.empty(norm.shape)
        kernels.adaptive(self.at_zero, self.at_infinity, self.slope, norm, gain)
        return gain

    @property
    def least(self) -> float:
        """The smallest gain, per second, which is that of a large error."""
        return self.at_infinity


GAIN = Choice(GAINS, default="adaptive", short=False, other=PER_SECOND)
