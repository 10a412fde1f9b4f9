"""Wheels that roll under their vehicles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from robsim.base.arrays import positive
from robsim.robot.joints.coupling import Coupling


@dataclass(frozen=True)
class Rolling(Coupling):
    """The angle of a wheel that rolls without slipping under its vehicle: radius in metres.

    The vehicle is the unicycle or car that carries the wheel, or carries what steers it.

    >>> Rolling(0.1).radius
    0.1
    """

    tied: ClassVar[bool] = False  # it remembers how far it has rolled
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive(self.radius, "rolling radius"))

    @property
    def yields(self) -> Literal["an angle", "a length"]:
        """An angle."""
        return "an angle"
