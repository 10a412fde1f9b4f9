"""Steered wheels with axles that meet in one point (Ackermann steering)."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import check_fields, register
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
