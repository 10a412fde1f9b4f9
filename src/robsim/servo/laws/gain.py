"""Gains: one number, or one that grows as the error or the command gets smaller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from robsim.base.arrays import Array, positive
from robsim.base.errors import InputError, suggest
from robsim.kernels import gain as kernels

Size = Literal["error", "command"]
SIZES: tuple[str, ...] = get_args(Size)  # what a gain can depend on


@dataclass(frozen=True)
class AdaptiveGain:
    """A gain that is low far from the goal, for gentle starts, and high near it.

    gain(x) = (at_zero - at_infinity) exp(-slope x/(at_zero - at_infinity)) + at_infinity
    (Kermorgant and Chaumette 2014, "Dealing with constraints in sensor-based robot control").
    `at_zero` and `at_infinity` are per second, `slope` is minus the derivative at x = 0, per second
    and unit of x. What x is, `of` says: of the "error" the 2-norm of e, in its own unit; of the
    "command" the largest component of the joint velocities that the law commands at a gain of one
    per second, without feed-forward, as in ViSP: max |L^+ e| of a free camera, in m and rad.
    InputError for numbers that are not positive, at_zero not above at_infinity, or another `of`.

    >>> gain = AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)
    >>> gain.at(np.array([0.0, 0.1, 10.0])).round(3)
    array([4.   , 1.965, 0.4  ])
    """

    at_zero: float
    at_infinity: float
    slope: float
    of: Size = "error"

    def __post_init__(self) -> None:
        for name in ("at_zero", "at_infinity", "slope"):
            object.__setattr__(self, name, positive(getattr(self, name), f"gain {name}"))
        if self.at_zero <= self.at_infinity:
            raise InputError(
                "an adaptive gain falls as the error grows: at_zero must be above at_infinity, "
                f"got {self.at_zero} and {self.at_infinity}"
            )
        if not isinstance(self.of, str) or self.of not in SIZES:
            hint = suggest(self.of, SIZES, "sizes")
            raise InputError(f"no size {self.of!r:.80} for a gain to depend on; {hint}")

    def at(self, size: Array) -> Array:
        """Return the gains (B,) per second at sizes (B,) of the error or the command."""
        gain = np.empty(size.shape)
        kernels.adaptive(self.at_zero, self.at_infinity, self.slope, size, gain)
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
