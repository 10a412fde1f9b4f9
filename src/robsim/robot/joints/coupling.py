"""Coordinates that depend on others: what all ways to follow have in common."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, NamedTuple

from robsim.declare import Text, family
from robsim.robot.joints.kind import JointKind

COUPLINGS = family("coupling")
Of = Annotated[str, Text(129, least=1), "Name of the coordinate that this one follows."]
UPRIGHT = 1e-9  # how far the axis of a wheel may point from where it should


class Source(NamedTuple):
    """The coordinate that another follows."""

    kind: JointKind
    follows: Coupling | None
    steers: bool  # whether it is the steering angle of a car


class Stand(NamedTuple):
    """Where a wheel stands on its car."""

    wheelbase: float
    x: float
    y: float


class Coupling:
    """The base of all ways in which a coordinate follows another."""

    code: ClassVar[int] = -1  # of its kernel
    tied: ClassVar[bool] = True  # whether the coordinate is no state of its own
    limited: ClassVar[bool] = True  # whether limits of the coordinate are looked at
    on_a_car: ClassVar[bool] = False  # whether it has to know where it stands on a car
    on_a_curve: ClassVar[bool] = False  # whether it has to know the curve of its rail
    wanted: ClassVar[str] = "one coordinate of one joint, or a steering angle"
    of: str

    @property
    def yields(self) -> Literal["an angle", "a length"] | None:
        """What the coordinate has to be; None for either."""
        return None

    @property
    def given(self) -> int:
        """Which of several things the kernel is asked for."""
        return 0

    @property
    def told(self) -> str:
        """What the coordinate is, in few words."""
        return ""

    def fits(self, source: Source) -> bool:
        """Return whether it can follow that."""
        return False

    def constants(self, stand: Stand | None) -> tuple[float, float, float]:
        """Return the numbers of its kernel."""
        return 0.0, 0.0, 0.0
