"""Steered wheels whose axles all meet in one point (Ackermann steering)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from robsim.declare import check_fields, register
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.couplings import Coupling, SourceName


@register("coupling", "ackermann")
@dataclass(frozen=True)
class Ackermann(Coupling):
    """The angle of a steered wheel of a car, by the steering angle at the middle of the axle.

    All axles point at the centre of the turn; `of` is the name of the steering coordinate, and
    where the wheel is follows from where its joint stands on the car: in front as a rule.

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
        """The steering angle that it follows, for overviews."""
        return f"{self.of}, by Ackermann"

    def fits(self, source: Any, steers: bool) -> bool:
        """Return whether the source is a steering angle."""
        return steers
