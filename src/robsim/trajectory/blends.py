"""Trajectories through several points, with parabolic blends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare import ListOf, register
from robsim.declare.joint_numbers import OneOrEach, get_followed_axes
from robsim.declare.spec import Context
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

STRETCH_ROUNDS, FIT_FACTOR = 200, 1.0 + 1e-9  # rounds of making segments longer; a factor that fits


class BlendPlan(NamedTuple):
    """The segments between m points, and the blends at these."""

    change: Array  # (m, n) of the velocity at each point
    seconds: Array  # (m,) of each blend
    middle: Array  # (m,) time of each blend's middle


VIA_POINTS = ListOf(AXIS_COORDINATES, 2)
CORNER_DISTANCES = OneOrEach(get_followed_axes)


@dataclass(frozen=True)
class BlendsTable:
    """The text form of a trajectory through points."""

    points: Annotated[
        Any,
        VIA_POINTS,
        "Two or more points, expand_per_axis of one number for expand_per_axis axis.",
    ]
    speed: AxisSpeed
    acceleration: AxisAcceleration
    corner: Annotated[
        PerAxis | None,
        CORNER_DISTANCES,
        "Largest distance at which points in between may be passed; None: any.",
    ] = None

    def made(self, c: Context) -> Blends:
        """Return the trajectory that the table describes."""
        return Blends(**vars(self))

    @classmethod
    def of(cls, value: Blends, c: Context) -> BlendsTable:
        """Return the table that describes a trajectory."""
        return cls(value.points, value.limits.speed, value.limits.acceleration, value.corner)


@register("trajectory", "blends")
@dataclass(frozen=True, eq=False, init=False)
class Blends(Value):
    """Straight segments between points, joined by parabolic blends, with rest at the ends only.

    points                (m, n) of n axes, in rad or m, m >= 2
    speed, acceleration   limits in rad/s or m/s and rad/s^2 or m/s^2: one number for all, or (n,)
    corner                how far the way may pass by a point in between, in rad or m: one number
                          for all axes, or (n,); None for whatever the limits give

    On a segment the velocity w is constant; at each point it changes at constant acceleration for
    a time tau, half of it before and half after the point, so that the way passes by the point
    at |w_after - w_before| tau/8 (`misses`): linear segments with parabolic blends (Craig 2005,
    section 7.3; Siciliano et al. 2009, section 4.2.3). At the first and the last point it rests.
    Each blend takes the least time that the limits allow, each segment the least that they, its
    two blends and `corner` allow, or not much more: segments where something does not fit are made
    longer until it does.

    >>> way = Blends([[0, 0], [1, 0], [1, 1]], speed=1.0, acceleration=4.0)
    >>> way.duration, way.misses.round(5).tolist()
    (2.25, [[0.0, 0.0], [0.03125, 0.03125], [0.0, 0.0]])
    >>> way.velocity(1.125)
    array([0.5, 0.5])
    """

    points: Any
    limits: Limits
    corner: PerAxis | None
    text_form: ClassVar[type[Any]] = BlendsTable

    def __init__(self, points: Any, *, speed: Any, acceleration: Any, corner: Any = None):
        given = as_floats(points, "points", ("m", "n"))
        if given.ndim != 2 or len(given) < 2 or not given.shape[1]:
            raise InputError(f"points: expected shape (m, n) with m > 1, got {given.shape}")
        same = np.flatnonzero((given[1:] == given[:-1]).all(axis=1))
        if same.size:
            raise InputError(f"points: number {same[0]} and {same[0] + 1} are the same")
        put = object.__setattr__
        put(self, "points", make_read_only(given))
        put(self, "limits", Limits(speed, acceleration))
        put(self, "corner", None if corner is None else check_per_axis(corner, "corner"))
        _ = self._plan  # the number of limits is checked now, not later

    @property
    def duration(self) -> float:
        """The duration in seconds."""
        return float(self._plan.middle[-1] + 0.5 * self._plan.seconds[-1])

    @property
    def times(self) -> Array:
        """The times (m,) in seconds of the start, of each point in between, and of the end."""
        return np.concatenate([[0.0], self._plan.middle[1:-1], [self.duration]])

    @property
    def misses(self) -> Array:
        """The distances (m, n) at which the path passes each point, per axis; zero at the ends."""
        found: Array = np.abs(self._plan.change) * self._plan.seconds[:, None] / 8.0
        found[[0, -1]] = 0.0
        return found

    def at(self, t: Any) -> Array:
        """Return the positions (..., n) of the axes at times t (...), in seconds."""
        times = check_times(t)
        T, (change, tau, _) = self.duration, self._plan
        x = self._since(times)
        blend = 0.5 * (x + 0.5 * tau) * (x + 0.5 * tau) / np.where(tau > 0, tau, 1.0)
        gone = np.where(np.abs(x) < 0.5 * tau, blend, np.maximum(x, 0.0))
        there = self.points[0] + _sum_over_points(gone, change)
        inside = (times > 0.0) & (times < T)
        rest: Array = np.where((times >= T)[..., None], self.points[-1], self.points[0])
        return np.where(inside[..., None], there, rest)

    def velocity(self, t: Any) -> Array:
        """Return the velocities (..., n) at times t (...), in rad/s or m/s."""
        times, (change, tau, _) = check_times(t), self._plan
        share = np.clip(self._since(times) / np.where(tau > 0, tau, 1.0) + 0.5, 0.0, 1.0)
        inside = (times > 0.0) & (times < self.duration)
        return np.where(inside[..., None], _sum_over_points(share, change), 0.0)

    def acceleration(self, t: Any) -> Array:
        """Return the accelerations (..., n) at times t (...), in rad/s^2 or m/s^2."""
        times, (change, tau, _) = check_times(t), self._plan
        on = (np.abs(self._since(times)) < 0.5 * tau) / np.where(tau > 0, tau, 1.0)
        return _sum_over_points(on, change)

    def _since(self, times: Array) -> Array:
        """Return seconds (..., m) since the middle of each blend, clipped to the duration."""
        return np.asarray(np.clip(times, 0.0, self.duration)[..., None] - self._plan.middle)

    @cached_property
    def _plan(self) -> BlendPlan:
        """The plan: segments long enough for the limits, for their blends and for the corners."""
        axes = self.points.shape[1]
        speed, acceleration = self.limits.of(axes)
        corner = np.full(axes, np.inf)
        if self.corner is not None:
            corner = expand_per_axis(self.corner, "corner", axes)
        way = np.diff(self.points, axis=0)
        seconds = np.asarray((np.abs(way) / speed).max(axis=1))
        shortages = _compute_shortages(way, seconds, acceleration, corner)
        for _ in range(STRETCH_ROUNDS):
            if (shortages <= FIT_FACTOR).all():
                break
            seconds = seconds * np.sqrt(shortages)
            shortages = _compute_shortages(way, seconds, acceleration, corner)
        seconds = seconds * np.sqrt(shortages.max())  # one factor for all, so that all fit
        change, tau = _plan_blends(way, seconds, acceleration)
        middle = 0.5 * tau[0] + np.concatenate([[0.0], np.cumsum(seconds)])
        return BlendPlan(make_read_only(change), make_read_only(tau), make_read_only(middle))


def _plan_blends(way: Array, seconds: Array, acceleration: Array) -> tuple[Array, Array]:
    """Return the velocity change (m, n) at each point, and the least time (m,) for it."""
    rest = np.zeros((1, way.shape[1]))
    change = np.diff(np.concatenate([rest, way / seconds[:, None], rest]), axis=0)
    return change, (np.abs(change) / acceleration).max(axis=1)


def _compute_shortages(way: Array, seconds: Array, acceleration: Array, corner: Array) -> Array:
    """Return the square of the factor (m - 1,) >= 1 by which each segment is too short.

    Where blends do not fit into a segment, its neighbours are made longer as well: if all times
    grow by a factor, blends shrink by it, and what they need of a segment by its square.
    """
    change, tau = _plan_blends(way, seconds, acceleration)
    need = np.concatenate([[1.0], 0.5 * (tau[:-1] + tau[1:]) / seconds, [1.0]])
    off = (np.abs(change) / corner).max(axis=1) * tau / 8.0
    off[[0, -1]] = 0.0
    found: Array = np.max([need[1:-1], need[:-2], need[2:], off[:-1], off[1:]], axis=0, initial=1.0)
    return found


def _sum_over_points(share: Array, change: Array) -> Array:
    """Return the sum (..., n) over points of share (..., m) times change (m, n), in fixed order."""
    total = share[..., :1] * change[0]
    for k in range(1, len(change)):
        total = total + share[..., k : k + 1] * change[k]
    return np.asarray(total)
