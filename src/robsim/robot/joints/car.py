"""Cars: vehicles that turn by their steering angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError
from robsim.declare import Angle, Length, Quantity, check_fields, described, register
from robsim.geometry.pose import broadcast_leading_shape
from robsim.robot.joints.planar_joint import PlanarKind

STEERING_ROW = 3  # the steering angle among the coordinates


@register("joint kind", "car")
@dataclass(frozen=True)
class Car(PlanarKind):
    """A vehicle with steered wheels: x, y, theta, the steering angle; v along x, omega about z."""

    name = "car"
    coordinates = (".x", ".y", ".theta", ".steering")
    units = ("m", "m", "rad", "rad")
    velocities = (".v", ".omega")
    rates = ("m/s", "rad/s")
    moves = ((False, 0), (True, 2))
    wheeled = True
    needs = "steering"

    def ranges(self, limits: tuple[float, float] | None, part: Steering) -> Array:
        """Return the limits (4, 2): infinite, except those of the steering angle."""
        rows = super().ranges(limits, part)
        rows[STEERING_ROW] = -part.limit, part.limit
        return rows


@described
@dataclass(frozen=True)
class Steering:
    """The steering of a car: wheelbase (metres), largest angle (rad), and its rate (rad/s).

    The angle is that of a front wheel in the middle, tan(angle) = wheelbase * omega / v. Between
    periods it changes by no more than rate * dt, and then it is held.

    >>> Steering(0.5).limit
    0.6
    """

    wheelbase: Annotated[float, Length(above=0), "Distance of the two axles."]
    limit: Annotated[float, Angle(above=0), "Largest steering angle."] = 0.6
    rate: Annotated[
        float, Quantity(above=0, dimension="turn rate"), "Largest rate of the steering angle."
    ] = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.limit >= np.pi / 2:
            raise InputError(f"steering limit must be below a right angle, got {self.limit:g} rad")

    def rates(self, speed: ArrayLike, angle: ArrayLike) -> Array:
        """Return velocities (..., 2) = (v, omega) of a car with a speed (m/s) and angle (rad).

        omega = v tan(angle)/wheelbase: the rates of a `Motion`, for a car that goes its own way.
        InputError: an angle beyond the limit.

        >>> Steering(0.5).rates(1.0, 0.3).round(6)
        array([1.      , 0.618672])
        """
        v, turned = (
            as_floats(speed, "speed (m/s)", ()),
            as_floats(angle, "steering angle (rad)", ()),
        )
        if (np.abs(turned) > self.limit).any():
            far = float(turned.flat[np.abs(turned).argmax()])
            raise InputError(f"steering angle {far:g} rad: the limit is {self.limit:g} rad")
        broadcast_leading_shape(v.shape, turned.shape, "speed and steering angle")
        return np.stack(np.broadcast_arrays(v, v * np.tan(turned) / self.wheelbase), axis=-1)
