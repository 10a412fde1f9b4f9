"""Wheels that roll below their vehicles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.declare import Length, check_fields, register
from robsim.robot.joints.couplings import Coupling


@register("coupling", "rolling")
@dataclass(frozen=True)
class Rolling(Coupling):
    """Angle of a wheel that rolls without slipping below its vehicle.

    The vehicle is a unicycle or car. It carries the wheel, or the joint that steers the wheel. The
    angle of the wheel is a state: it is integrated from the motion of the vehicle. With the speed v
    of the hub along the rolling direction, the wheel turns at the rate v / radius.

    Examples
    --------
    >>> Rolling(0.1).radius
    0.1
    """

    yields = "an angle"
    is_coupled = False  # the angle is a state, integrated from the motion
    radius: Annotated[float, Length(above=0), "Radius of the wheel."]

    def __post_init__(self) -> None:
        check_fields(self)
