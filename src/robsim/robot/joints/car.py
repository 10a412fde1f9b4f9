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

STEERING_ROW = 3  # index of the steering angle among the coordinates


@register("joint kind", "car")
@dataclass(frozen=True)
class Car(PlanarKind):
    """Vehicle with steered wheels, which cannot move sideways.

    Its coordinates are x, y, theta and the steering angle, and its velocities are v along x and
    omega about z.
    """

    name = "car"
    coordinates = (".x", ".y", ".theta", ".steering")
    units = ("m", "m", "rad", "rad")
    velocities = (".v", ".omega")
    rates = ("m/s", "rad/s")
    moves = ((False, 0), (True, 2))
    wheeled = True
    needs = "steering"

    def ranges(self, limits: tuple[float, float] | None, part: Steering) -> Array:
        """Return the limits (4, 2): infinite, except the limits of the steering angle."""
        rows = super().ranges(limits, part)
        rows[STEERING_ROW] = -part.limit, part.limit
        return rows


@described
@dataclass(frozen=True)
class Steering:
    """Steering of a car: wheelbase, and limits of the steering angle and its rate.

    The steering angle is the angle of a front wheel in the middle of the axle,
    tan(angle) = wheelbase * omega / v. Between control periods it changes by at most rate * dt, and
    then it is constant. A longer wheelbase or a smaller limit makes the tightest turn wider.

    Raises
    ------
    InputError
        If the limit is a right angle or more.

    Examples
    --------
    >>> Steering(0.5).limit
    0.6
    """

    wheelbase: Annotated[float, Length(above=0), "Distance between the two axles."]
    limit: Annotated[float, Angle(above=0), "Largest steering angle."] = 0.6
    rate: Annotated[
        float, Quantity(above=0, dimension="turn rate"), "Largest rate of the steering angle."
    ] = 1.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.limit >= np.pi / 2:
            raise InputError(f"steering limit must be below a right angle, got {self.limit:g} rad")

    def rates(self, speed: ArrayLike, angle: ArrayLike) -> Array:
        """Return the velocities (v, omega) of a car at a given speed and steering angle.

        The turn rate is omega = v tan(angle) / wheelbase.

        Parameters
        ----------
        speed : array_like of shape (...)
            Speed v along the x axis of the car, in m/s.
        angle : array_like of shape (...)
            Steering angle in rad, within the limit.

        Returns
        -------
        ndarray of shape (..., 2)
            Velocities (v, omega) in m/s and rad/s, for example as rates of a `Motion`.

        Raises
        ------
        InputError
            If an angle is beyond the limit.

        Examples
        --------
        >>> Steering(0.5).rates(1.0, 0.3).round(6)
        array([1.      , 0.618672])
        """
        v, angles = (
            as_floats(speed, "speed (m/s)", ()),
            as_floats(angle, "steering angle (rad)", ()),
        )
        if (np.abs(angles) > self.limit).any():
            largest = float(angles.flat[np.abs(angles).argmax()])
            raise InputError(f"steering angle {largest:g} rad: the limit is {self.limit:g} rad")
        broadcast_leading_shape(v.shape, angles.shape, "speed and steering angle")
        return np.stack(np.broadcast_arrays(v, v * np.tan(angles) / self.wheelbase), axis=-1)
