"""Imperfections: what every kind of them declares, and the facts on which statements rest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare import Declared

Statement = tuple[str, dict[str, float]]  # a sentence and its numbers


class RunFacts(Protocol):
    """The facts of a run from which an imperfection states its part in it."""

    @property
    def dt(self) -> float:
        """The control period in seconds."""

    @property
    def gain(self) -> float:
        """The largest gain of the task, per second; NaN for a user's own kind of task."""

    @property
    def robust(self) -> bool:
        """Whether the task has robust weights."""

    @property
    def columns(self) -> NDArray[np.int64]:
        """The numbers of the commanded velocities among those of the scene."""

    @property
    def velocities(self) -> tuple[Array, Array]:
        """The commanded and the actual velocities (T, nv) of the scene."""

    def lasting(self, what: str) -> Statement:
        """Return the statement of what keeps the error from vanishing, with its final size."""


def in_periods(count: float) -> str:
    """Return a number of control periods with its noun.

    >>> in_periods(1.0), in_periods(2.5)
    ('1 control period', '2.5 control periods')
    """
    whole = round(count)
    text = str(whole) if abs(count - whole) < 1e-6 else f"{count:.3g}"
    return f"{text} control period{'s' * (text != '1')}"


class Imperfection(Declared):
    """A kind of imperfection, of the images or of the joints, as far as sentences go.

    title     its noun, such as "pixel noise"
    left_out  noun for `advise` if it has no part in the linear loop and its noise; "" for none
    """

    title: ClassVar[str]
    left_out: ClassVar[str] = "effects of your own"

    @property
    def label(self) -> str:
        """The name of the class, for sentences and errors."""
        return type(self).__name__

    def stated(self, facts: RunFacts) -> Statement:
        return facts.lasting(f"{self.title.capitalize()}: {self.label}")

    def cause(self, dt: float) -> str:
        """Return the phrase for its part in the timing of the loop, as a limit of the gain."""
        return self.title

    def caveats(self, robust: bool, noise: float) -> Iterator[str]:
        """Yield what advice misses of it, beside the noise (px) that robust weights leave."""
        yield from ()
