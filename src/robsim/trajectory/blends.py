"""Trajectories through several points, with parabolic blends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare import ListOf, register
from robsim.declare.context import Context
from robsim.declare.joint_numbers import OneOrEach, get_followed_axes
from robsim.trajectory.axis_limits import (
    AXIS_COORDINATES,
    AxisAcceleration,
    AxisSpeed,
    Limits,
    PerAxis,
    check_per_axis,
    expand_per_axis,
)
from robsim.trajectory.time_law import check_times

STRETCH_ROUNDS = 200  # largest number of rounds that stretch segments
FIT_FACTOR = 1.0 + 1e-9  # segments fit if no longer duration by more than this factor is needed


class BlendPlan(NamedTuple):
    """Blends at m points, which also determine the segments between the points."""

    change: Array  # (m, n) change of velocity at each point
    seconds: Array  # (m,) duration of each blend
    middle: Array  # (m,) time of the middle of each blend


VIA_POINTS = ListOf(AXIS_COORDINATES, 2)
CORNER_DISTANCES = OneOrEach(get_followed_axes)


@dataclass(frozen=True)
class BlendsTable:
    """Text form of a trajectory through points."""

    points: Annotated[ArrayLike, VIA_POINTS, "Two or more points, with a number for each axis."]
    speed: AxisSpeed
    acceleration: AxisAcceleration
    corner: Annotated[
        PerAxis | None,
        CORNER_DISTANCES,
        "Largest distance between the path and each intermediate point. None: no limit.",
    ] = None

    def build_value(self, c: Context) -> Blends:
        """Return the trajectory that the table describes."""
        return Blends(**vars(self))

    @classmethod
    def of(cls, value: Blends, c: Context) -> BlendsTable:
        """Return the table that describes a trajectory."""
        return cls(value.points, value.limits.speed, value.limits.acceleration, value.corner)


@register("trajectory", "blends")
@dataclass(frozen=True, eq=False, init=False)
class Blends(Value):
    """Straight segments between points, joined by parabolic blends, with rest at both ends.

    On a segment the velocity is constant. At each point it changes by dw at constant acceleration
    for a time tau, half before and half after the point, so the path misses the point by the
    distance |dw| tau / 8 (linear segments with parabolic blends: Craig 2005, section 7.3; Siciliano
    et al. 2009, section 4.2.3). Each blend takes the least time that the acceleration allows, and
    each segment about the least time that the speed, its two blends and `corner` allow: segments
    that are too short are stretched until everything fits.

    Use it to pass points without stopping. A smaller `corner` keeps the path closer to the points
    and makes the motion slower.

    Parameters
    ----------
    points : array_like of shape (m, n)
        Points of n axes, in rad or m, with m >= 2. Consecutive points differ.
    speed : float or array_like of shape (n,)
        Largest speed of all axes or of each axis, in rad/s or m/s.
    acceleration : float or array_like of shape (n,)
        Largest acceleration of all axes or of each axis, in rad/s^2 or m/s^2.
    corner : float or array_like of shape (n,), optional
        Largest distance between the path and each intermediate point, per axis, in rad or m.
        Default: no limit.

    Attributes
    ----------
    points : ndarray of shape (m, n)
        Points, read-only.
    limits : Limits
        Speed and acceleration limits.
    corner : float, tuple of float or None
        Largest distance from intermediate points.

    Raises
    ------
    InputError
        If the points do not have the shape (m, n), two consecutive points are equal, or the number
        of limits differs from n.

    Examples
    --------
    >>> path = Blends([[0, 0], [1, 0], [1, 1]], speed=1.0, acceleration=4.0)
    >>> path.duration, path.misses.round(5).tolist()
    (2.25, [[0.0, 0.0], [0.03125, 0.03125], [0.0, 0.0]])
    >>> path.velocity(1.125)
    array([0.5, 0.5])
    """

    points: Array
    limits: Limits
    corner: PerAxis | None
    text_form: ClassVar[type[Any]] = BlendsTable

    def __init__(
        self,
        points: ArrayLike,
        *,
        speed: ArrayLike,
        acceleration: ArrayLike,
        corner: ArrayLike | None = None,
    ):
        array = as_floats(points, "points", ("m", "n"))
        if array.ndim != 2 or len(array) < 2 or not array.shape[1]:
            raise InputError(f"points: expected shape (m, n) with m > 1, got {array.shape}")
        repeated = np.flatnonzero((array[1:] == array[:-1]).all(axis=1))
        if repeated.size:
            raise InputError(f"points: number {repeated[0]} and {repeated[0] + 1} are the same")
        put = object.__setattr__
        put(self, "points", make_read_only(array))
        put(self, "limits", Limits(speed, acceleration))
        put(self, "corner", None if corner is None else check_per_axis(corner, "corner"))
        _ = self._plan  # raises if the number of limits is wrong

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return float(self._plan.middle[-1] + 0.5 * self._plan.seconds[-1])

    @property
    def times(self) -> Array:
        """Times (m,) in seconds of the start, of each intermediate point, and of the end."""
        return np.concatenate([[0.0], self._plan.middle[1:-1], [self.duration]])

    @property
    def misses(self) -> Array:
        """Distances (m, n) between the path and each point, per axis; zero at both ends."""
        distances: Array = np.abs(self._plan.change) * self._plan.seconds[:, None] / 8.0
        distances[[0, -1]] = 0.0
        return distances

    def at(self, t: ArrayLike) -> Array:
        """Return the positions (..., n) of the axes at times t (...) in seconds."""
        times = check_times(t)
        T, (change, tau, _) = self.duration, self._plan
        x = self._since(times)
        blend = 0.5 * (x + 0.5 * tau) * (x + 0.5 * tau) / np.where(tau > 0, tau, 1.0)
        progress = np.where(np.abs(x) < 0.5 * tau, blend, np.maximum(x, 0.0))
        moving = self.points[0] + _sum_over_points(progress, change)
        inside = (times > 0.0) & (times < T)
        rest: Array = np.where((times >= T)[..., None], self.points[-1], self.points[0])
        return np.where(inside[..., None], moving, rest)

    def velocity(self, t: ArrayLike) -> Array:
        """Return the velocities (..., n) in rad/s or m/s at times t (...) in seconds."""
        times, (change, tau, _) = check_times(t), self._plan
        share = np.clip(self._since(times) / np.where(tau > 0, tau, 1.0) + 0.5, 0.0, 1.0)
        inside = (times > 0.0) & (times < self.duration)
        return np.where(inside[..., None], _sum_over_points(share, change), 0.0)

    def acceleration(self, t: ArrayLike) -> Array:
        """Return the accelerations (..., n) in rad/s^2 or m/s^2 at times t (...) in seconds."""
        times, (change, tau, _) = check_times(t), self._plan
        rate = (np.abs(self._since(times)) < 0.5 * tau) / np.where(tau > 0, tau, 1.0)
        return _sum_over_points(rate, change)

    def _since(self, times: Array) -> Array:
        """Return seconds (..., m) since the middle of each blend; times are clipped."""
        return np.asarray(np.clip(times, 0.0, self.duration)[..., None] - self._plan.middle)

    @cached_property
    def _plan(self) -> BlendPlan:
        """Blends with segments that are long enough for speeds, blends and corners."""
        axes = self.points.shape[1]
        speed, acceleration = self.limits.of(axes)
        corner = np.full(axes, np.inf)
        if self.corner is not None:
            corner = expand_per_axis(self.corner, "corner", axes)
        sides = np.diff(self.points, axis=0)
        seconds = np.asarray((np.abs(sides) / speed).max(axis=1))
        shortages = _compute_shortages(sides, seconds, acceleration, corner)
        for _ in range(STRETCH_ROUNDS):
            if (shortages <= FIT_FACTOR).all():
                break
            seconds = seconds * np.sqrt(shortages)
            shortages = _compute_shortages(sides, seconds, acceleration, corner)
        seconds = seconds * np.sqrt(shortages.max())  # one factor that makes all segments fit
        change, tau = _plan_blends(sides, seconds, acceleration)
        middle = 0.5 * tau[0] + np.concatenate([[0.0], np.cumsum(seconds)])
        return BlendPlan(make_read_only(change), make_read_only(tau), make_read_only(middle))


def _plan_blends(sides: Array, seconds: Array, acceleration: Array) -> tuple[Array, Array]:
    """Return the change of velocity (m, n) at each point, and its least duration (m,)."""
    rest = np.zeros((1, sides.shape[1]))
    change = np.diff(np.concatenate([rest, sides / seconds[:, None], rest]), axis=0)
    return change, (np.abs(change) / acceleration).max(axis=1)


def _compute_shortages(sides: Array, seconds: Array, acceleration: Array, corner: Array) -> Array:
    """Return the squared factor (m - 1,), at least 1, to stretch the time of each segment.

    If blends do not fit into a segment, its neighbours are stretched as well. A factor on all times
    divides the duration of the blends by the factor, and their fraction of a segment by its square.
    """
    change, tau = _plan_blends(sides, seconds, acceleration)
    need = np.concatenate([[1.0], 0.5 * (tau[:-1] + tau[1:]) / seconds, [1.0]])
    distance = (np.abs(change) / corner).max(axis=1) * tau / 8.0
    distance[[0, -1]] = 0.0
    factors: Array = np.max(
        [need[1:-1], need[:-2], need[2:], distance[:-1], distance[1:]], axis=0, initial=1.0
    )
    return factors


def _sum_over_points(share: Array, change: Array) -> Array:
    """Return the sum (..., n) over points of share (..., m) times change (m, n), in fixed order."""
    total = share[..., :1] * change[0]
    for k in range(1, len(change)):
        total = total + share[..., k : k + 1] * change[k]
    return np.asarray(total)
