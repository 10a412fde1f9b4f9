"""Wheels of vehicles: wheels that are steered (Ackermann steering), and wheels that roll."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.declare import Length, check_fields, register
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.couplings import Coupling, SourceJoint, SourceName


@register("coupling", "ackermann")
@dataclass(frozen=True)
class Ackermann(Coupling):
    """Angle of a steered wheel of a car, as a function of the steering angle.

    The steering angle refers to the middle of the front axle. The axles of all wheels point at the
    centre of the turn, so the angle of a wheel depends on the position of its joint on the car,
    usually at the front.

    Examples
    --------
    >>> Ackermann("body.steering").of
    'body.steering'
    """

    stage = forward_kinematics.steer_wheel
    yields = "an angle"
    limited = False
    on_a_car = True
    wanted = "the steering angle of a car"
    of: SourceName

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def relation(self) -> str:
        """Name of the steering angle, for overviews."""
        return f"{self.of}, by Ackermann"

    def fits(self, source: SourceJoint, steers: bool) -> bool:
        """Return whether the source is a steering angle."""
        return steers


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
