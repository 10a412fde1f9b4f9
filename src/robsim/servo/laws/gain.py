"""Gains: one number, or one that grows as the error gets smaller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, positive
from robsim.base.errors import InputError
from robsim.kernels import gain as kernels


@dataclass(frozen=True)
class AdaptiveGain:
    """A gain that is low for large errors, for gentle starts, and high near the goal.

    gain(x) = (at_zero - at_infinity) exp(-slope x/(at_zero - at_infinity)) + at_infinity, with x
    the 2-norm of e in its own unit (Kermorgant and Chaumette 2014, "Dealing with constraints in
    sensor-based robot control"). `at_zero` and `at_infinity` are per second, `slope` is minus the
    derivative at x = 0, per second and unit of e.

    >>> gain = AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)
    >>> gain.of(np.array([0.0, 0.1, 10.0])).round(3)
    array([4.   , 1.965, 0.4  ])
    """

    at_zero: float
    at_infinity: float
    slope: float

    def __post_init__(self) -> None:
        for name in ("at_zero", "at_infinity", "slope"):
            object.__setattr__(self, name, positive(getattr(self, name), f"gain {name}"))
        if self.at_zero <= self.at_infinity:
            raise InputError(
                "an adaptive gain falls as the error grows: at_zero must be above at_infinity, "
                f"got {self.at_zero} and {self.at_infinity}"
            )

    def of(self, norm: Array) -> Array:
        """Gain (B,) per second at norms (B,) of the error."""
        gain = np.empty(norm.shape)
        kernels.adaptive(self.at_zero, self.at_infinity, self.slope, norm, gain)
        return gain

    @property
    def least(self) -> float:
        """The smallest gain there is, per second: that of a large error."""
        return self.at_infinity


def as_gain(value: Any) -> float | AdaptiveGain:
    """A gain from itself or from a positive number per second."""
    if isinstance(value, AdaptiveGain):
        return value
    try:
        return positive(value, "gain")
    except InputError:
        raise InputError(
            "gain must be a positive number per second or AdaptiveGain(at_zero, at_infinity, "
            f"slope), got {value!r:.80}"
        ) from None
