"""Steered wheels whose axles all meet in one point (Ackermann steering)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from robsim.declare import check_fields, register
from robsim.kernels.bodies import placing
from robsim.kernels.machine.stage import Stage
from robsim.robot.joints.coupling import Coupling, Of, Source, Stand


@register("coupling", "ackermann")
@dataclass(frozen=True)
class Ackermann(Coupling):
    """The angle of a steered wheel of a car, by the steering angle at the middle of the axle.

    All axles point at the centre of the turn; `of` is the name of the steering coordinate, and
    where the wheel is follows from where its joint stands on the car: in front as a rule.

    >>> Ackermann("body.steering").of
    'body.steering'
    """

    stage: ClassVar[Stage | None] = placing.steer
    limited: ClassVar[bool] = False
    on_a_car: ClassVar[bool] = True
    wanted: ClassVar[str] = "the steering angle of a car"
    of: Of

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def yields(self) -> Literal["an angle", "a length"]:
        """The kind of coordinate that it gives: an angle."""
        return "an angle"

    @property
    def relation(self) -> str:
        """The steering angle that it follows, for overviews."""
        return f"{self.of}, by Ackermann"

    def fits(self, source: Source) -> bool:
        """Return whether the source is a steering angle."""
        return source.steers

    def constants(self, stand: Stand | None) -> tuple[float, float, float]:
        """Return the wheelbase and the position of the wheel on its car."""
        assert stand is not None  # it is on a car
        return stand.wheelbase, stand.x, stand.y
