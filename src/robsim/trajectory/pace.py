"""Timing of the motion of a frame from one pose to another."""

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
    """Duration of a minimum-jerk motion, or limits of the fastest motion.

    Give either `duration`, or limits: a speed with an acceleration for the origin, for the
    orientation, or for both. With one pair of limits, this pair alone determines the duration.

    Attributes
    ----------
    duration : float or None
        Duration in seconds.
    speed, acceleration : float or None
        Limits of the origin, in m/s and m/s^2.
    turn, turn_acceleration : float or None
        Limits of the orientation, in rad/s and rad/s^2.

    Raises
    ------
    InputError
        If neither or both of duration and limits are given, or a pair is incomplete.

    Examples
    --------
    >>> Pace(speed=1.0, acceleration=2.0).timing(np.array(2.0), np.array(0.5)).seconds
    array(2.5)
    """

    duration: Duration = None
    speed: OriginSpeed = None
    acceleration: OriginAcceleration = None
    turn: TurnRate = None
    turn_acceleration: TurnAcceleration = None

    def __post_init__(self) -> None:
        present = [each.name for each in fields(self) if getattr(self, each.name) is not None]
        if ("duration" in present) == (len(present) > ("duration" in present)):
            names = " and ".join(present) or "nothing"
            raise InputError(
                "give either duration, or speed and acceleration, turn and turn_acceleration, or "
                f"both pairs of limits; got {names}"
            )
        check_fields(self)
        for name in ("speed", "turn"):
            pair = (name, "acceleration" if name == "speed" else "turn_acceleration")
            if len({*pair} & {*present}) == 1:
                raise InputError(f"{pair[0]} and {pair[1]}: give both of them, or none")

    @property
    def limits(self) -> Array:
        """Limits (2, 2): speed and turn rate, then their accelerations; infinite if not given."""
        limits = (self.speed, self.turn), (self.acceleration, self.turn_acceleration)
        return np.array([[math.inf if x is None else x for x in each] for each in limits])

    def timing(self, distance: Array, angle: Array) -> Timing:
        """Return the timing of distances (...) in metres and angles (...) in radians.

        Raise InputError if a distance or an angle is not zero and has no limits.
        """
        if self.duration is not None:
            return Timing(np.asarray(self.duration))
        displacements = np.stack([distance, angle], axis=-1)
        timing = Timing.shortest(displacements, *self.limits)
        if ((timing.seconds == 0) & (displacements > 0).any(axis=-1)).any():
            missing = (
                "speed and acceleration" if self.speed is None else "turn and turn_acceleration"
            )
            raise InputError(f"the duration of this motion is undefined: give {missing} as well")
        return timing
