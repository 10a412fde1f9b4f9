"""The timing of a frame's motion from one pose to another."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Quantity, Time, check_fields
from robsim.trajectory.time_law import Timing

Duration = Annotated[
    float | None, Time(above=0), "Duration of the motion, along a quintic polynomial."
]
OriginSpeed = Annotated[
    float | None, Quantity(above=0, dimension="speed"), "Largest speed of the origin."
]
OriginAcceleration = Annotated[
    float | None, Quantity(above=0, dimension="acceleration"), "Largest acceleration of the origin."
]
TurnRate = Annotated[float | None, Quantity(above=0, dimension="turn rate"), "Largest turn rate."]
TurnAcceleration = Annotated[
    float | None, Quantity(above=0, dimension="turn acceleration"), "Largest turn acceleration."
]


@dataclass(frozen=True)
class Pace:
    """A duration for a minimum-jerk motion, or limits for the shortest motion within them.

    speed and acceleration are limits of the origin, turn and turn_acceleration of the orientation;
    they come in pairs, and a pair that is not given limits nothing.

    >>> Pace(speed=1.0, acceleration=2.0).timing(np.array(2.0), np.array(0.5)).seconds
    array(2.5)
    """

    duration: Duration = None
    speed: OriginSpeed = None
    acceleration: OriginAcceleration = None
    turn: TurnRate = None
    turn_acceleration: TurnAcceleration = None

    def __post_init__(self) -> None:
        given = [each.name for each in fields(self) if getattr(self, each.name) is not None]
        if ("duration" in given) == (len(given) > ("duration" in given)):
            listed = " and ".join(given) or "nothing"
            raise InputError(
                "give either duration, or speed and acceleration, turn and turn_acceleration, or "
                f"both pairs of limits; got {listed}"
            )
        check_fields(self)
        for name in ("speed", "turn"):
            pair = (name, "acceleration" if name == "speed" else "turn_acceleration")
            if len({*pair} & {*given}) == 1:
                raise InputError(f"{pair[0]} and {pair[1]}: give both of them, or none")

    @property
    def limits(self) -> Array:
        """The limits (2, 2) of speed and turn, then of their accelerations; infinite for none."""
        limits = (self.speed, self.turn), (self.acceleration, self.turn_acceleration)
        return np.array([[math.inf if x is None else x for x in each] for each in limits])

    def timing(self, way: Array, angle: Array) -> Timing:
        """Return the timing of distances (...) in metres and angles (...) in radians.

        InputError: nothing limits one of them.
        """
        if self.duration is not None:
            return Timing(np.asarray(self.duration))
        ways = np.stack([way, angle], axis=-1)
        made = Timing.shortest(ways, *self.limits)
        if ((made.seconds == 0) & (ways > 0).any(axis=-1)).any():
            missing = (
                "speed and acceleration" if self.speed is None else "turn and turn_acceleration"
            )
            raise InputError(f"this motion would take no time: give {missing} as well")
        return made
