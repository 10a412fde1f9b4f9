"""Gains: a constant, or a function of the size of the error or the command."""

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
GainArgument = Literal["error", "command"]  # argument x of an adaptive gain


@register("gain", "adaptive")
@dataclass(frozen=True)
class AdaptiveGain(DeclaredValue):
    """Gain that is low far from the goal, for a gentle start, and high near the goal.

        gain(x) = (at_zero - at_infinity) exp(-slope x/(at_zero - at_infinity)) + at_infinity

    (Kermorgant and Chaumette 2014, "Dealing with constraints in sensor-based robot control"). The
    argument x is the 2-norm of e for of="error". For of="command" it is the largest component of
    the joint velocities that the law commands at a gain of 1/s without feed-forward, as in ViSP:
    max |L^+ e| for a free camera, in m and rad.

    With a constant gain the speed falls with the error, and the end of the motion takes long. The
    adaptive gain keeps the speed more even: it limits the first velocity by `at_infinity` and the
    time of the last phase by `at_zero`. `at_zero` is the gain in the linear loop near the goal, so
    delays bound it (see `advise`). A larger `slope` moves the rise of the gain closer to the goal.

    Raises
    ------
    InputError
        Unless at_zero is above at_infinity.

    Examples
    --------
    >>> gain = AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)
    >>> gain.at(np.array([0.0, 0.1, 10.0])).round(3)
    array([4.   , 1.965, 0.4  ])
    """

    at_zero: Annotated[float, PER_SECOND, "Gain at x = 0, in 1/s."]
    at_infinity: Annotated[float, PER_SECOND, "Gain far from the goal, in 1/s, below at_zero."]
    slope: Annotated[float, Number(above=0), "Minus the derivative at x = 0, in 1/s per unit of x."]
    of: Annotated[
        GainArgument,
        Word(get_args(GainArgument), "size"),
        "Argument x: the size of the error, or the size of the command at a gain of 1/s.",
    ] = "error"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.at_zero <= self.at_infinity:
            raise InputError(
                "an adaptive gain falls as the error grows: at_zero must be above at_infinity, "
                f"got {self.at_zero} and {self.at_infinity}"
            )

    def at(self, size: Array) -> Array:
        """Return the gain at sizes of the error or the command.

        Parameters
        ----------
        size : array_like of shape (..., B)
            Sizes x of the error or the command, not negative.

        Returns
        -------
        ndarray of shape (..., B)
            Gains in 1/s.

        Raises
        ------
        InputError
            If a size is negative or not finite.
        """
        sizes = as_floats(size, "size", ("B",))
        if (sizes < 0).any():
            raise InputError(f"size: expected no negative size, got {sizes.min():g}")
        gain = np.empty(sizes.size)
        kernels.compute_gains(self.at_zero, self.at_infinity, self.slope, sizes.ravel(), gain)
        return gain.reshape(sizes.shape)

    @property
    def least(self) -> float:
        """Smallest gain in 1/s, reached for large errors."""
        return self.at_infinity


GAIN = KindOf(GAINS, default="adaptive", short=False, other=PER_SECOND)
