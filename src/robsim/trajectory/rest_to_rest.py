"""Base class of motions of axes from rest to rest."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare.joint_numbers import PerJoint, get_followed_axes
from robsim.geometry.pose import broadcast_leading_shape
from robsim.trajectory.time_law import Timing, check_times


@dataclass(frozen=True)
class EndCoordinates(PerJoint):
    """Declaration of the coordinates of axes; in Python, an array may describe several motions."""

    def check(self, value: Any, what: str) -> Array:
        return make_read_only(as_floats(value, what, ("n",)))


END_COORDINATES = EndCoordinates(get_followed_axes)


@dataclass(frozen=True, eq=False)
class RestToRest(Value, ABC):
    """Base class of motions of axes that start and stop together.

    The axes rest at `start` before the motion and at `end` after it. A subclass defines `timing`.

    Attributes
    ----------
    start, end : ndarray of shape (..., n)
        Coordinates of n axes in rad or m. Leading axes describe several motions at once, which are
        broadcast against the times.
    """

    start: Annotated[Array, END_COORDINATES, "Coordinates of the axes at the start."]
    end: Annotated[Array, END_COORDINATES, "Coordinates of the axes at the end."]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, start: ArrayLike, end: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        start, end = as_floats(self.start, "start", ("n",)), as_floats(self.end, "end", ("n",))
        if start.shape[-1] != end.shape[-1]:
            raise InputError(f"start and end: {start.shape[-1]} axes and {end.shape[-1]} axes")
        broadcast_leading_shape(start.shape[:-1], end.shape[:-1], "start and end")
        object.__setattr__(self, "start", make_read_only(start))
        object.__setattr__(self, "end", make_read_only(end))

    @property
    @abstractmethod
    def timing(self) -> Timing:
        """Timing of the motion."""

    def at(self, t: ArrayLike) -> Array:
        """Return the positions (..., n) of the axes, in rad or m, at times t (...) in seconds."""
        share = self.timing.at(check_times(t)).s
        position: Array = np.where(share < 1.0, self.start + share * self._displacement, self.end)
        return position

    def velocity(self, t: ArrayLike) -> Array:
        """Return the velocities (..., n) in rad/s or m/s at times t (...) in seconds."""
        return self.timing.at(check_times(t)).rate * self._displacement

    def acceleration(self, t: ArrayLike) -> Array:
        """Return the accelerations (..., n) in rad/s^2 or m/s^2 at times t (...) in seconds."""
        return self.timing.at(check_times(t)).acceleration * self._displacement

    @cached_property
    def _displacement(self) -> Array:
        """Displacement (..., n) from start to end."""
        return np.asarray(self.end - self.start)
