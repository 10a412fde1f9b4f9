"""Wheels that roll below their vehicles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.declare import Length, check_fields, register
from robsim.robot.joints.couplings import Coupling


@register("coupling", "rolling")
@dataclass(frozen=True)
class Rolling(Coupling):
    """The angle of a wheel that rolls without slipping below its vehicle; radius in metres.

    The vehicle is the unicycle or car that carries the wheel, or carries what steers it.

    >>> Rolling(0.1).radius
    0.1
    """

    yields = "an angle"
    tied = False  # its angle is a state, integrated from the motion
    radius: Annotated[float, Length(above=0), "Radius of the wheel."]

    def __post_init__(self) -> None:
        check_fields(self)
