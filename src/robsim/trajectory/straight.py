"""Straight motions of a frame, with a rotation about one axis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, euclidean_length, move_runs_first, move_runs_last
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare.spec import Context
from robsim.geometry.pose import Pose, as_pose, broadcast_leading_shape, homogeneous_matrix
from robsim.geometry.pose_table import POSE
from robsim.kernels.formulas import pose_interpolation as kernels
from robsim.trajectory.pace import (
    Duration,
    OriginAcceleration,
    OriginSpeed,
    Pace,
    TurnAcceleration,
    TurnRate,
)
from robsim.trajectory.time_law import TimeLawShares, Timing, check_times


@dataclass(frozen=True)
class StraightTable:
    """The text form of a straight motion."""

    start: Annotated[Pose, POSE, "Pose at the start."]
    end: Annotated[Pose, POSE, "Pose at the end."]
    duration: Duration = None
    speed: OriginSpeed = None
    acceleration: OriginAcceleration = None
    turn: TurnRate = None
    turn_acceleration: TurnAcceleration = None

    def made(self, c: Context) -> Straight:
        """Return the motion that the table describes."""
        return Straight(**vars(self))

    @classmethod
    def of(cls, value: Straight, c: Context) -> StraightTable:
        """Return the table that describes a motion."""
        return cls(value.start, value.end, **vars(value.pace))


@dataclass(frozen=True, eq=False, init=False)
class Straight(Value):
    """A motion from one pose to another along a straight line, with rotation about a fixed axis.

    start, end            poses in one base frame; batches (...) of them are several motions at
                          once, and times are broadcast against these
    duration              seconds, of a motion of least jerk as `Quintic`; or limits, of the
                          shortest motion under these as `Trapezoid`:
    speed, acceleration   of the origin, m/s and m/s^2
    turn, turn_acceleration
                          of the orientation, rad/s and rad/s^2

    The orientation is start exp(s theta u), with theta u the rotation vector from start to end:
    spherical linear interpolation (Shoemake 1985; Siciliano et al. 2009, section 4.3.3). Of half a
    circle either way is right, and one is taken.

    >>> move = Straight(Pose.at(0, 0, 1), Pose.at(2, 0, 1, rpy=(0, 0, np.pi / 2)), duration=4.0)
    >>> Pose(move.at(2.0))
    <Pose position [1.0, 0.0, 1.0] rotvec [0.0, 0.0, 0.7854]>
    >>> move.twist(2.0).round(4)
    array([0.9375, 0.    , 0.    , 0.    , 0.    , 0.7363])
    """

    start: Pose
    end: Pose
    pace: Pace
    text_form: ClassVar[type[Any]] = StraightTable

    def __init__(
        self,
        start: Any,
        end: Any,
        duration: Any = None,
        *,
        speed: Any = None,
        acceleration: Any = None,
        turn: Any = None,
        turn_acceleration: Any = None,
    ):
        put = object.__setattr__
        put(self, "start", _check_end_pose(start, "start"))
        put(self, "end", _check_end_pose(end, "end"))
        broadcast_leading_shape(
            self.start.matrix.shape[:-2], self.end.matrix.shape[:-2], "start and end"
        )
        put(self, "pace", Pace(duration, speed, acceleration, turn, turn_acceleration))
        _ = self._timing  # limits that are missing are an error now, not later

    @property
    def duration(self) -> Any:
        """The duration in seconds, (...) for several motions."""
        seconds = self._timing.seconds
        return seconds if seconds.ndim else float(seconds)

    def at(self, t: Any) -> Array:
        """Return poses (..., 4, 4) in the base frame at times t (...), in seconds."""
        s = self._shares(t).s
        T, way, turn, end = self._wide(s, self._start, self._way, self._turn, self._end)
        runs = T.shape[-1]
        twist, step, out = np.empty((6, runs)), np.empty(T.shape), np.empty(T.shape)
        kernels.interpolate_pose(T, way, turn, move_runs_last(s, 1), end, twist, step, out)
        return homogeneous_matrix(out, s.shape[:-1])

    def twist(self, t: Any) -> Array:
        """Return twists (..., 6) = (v, omega) of the frame in base axes, in m/s and rad/s."""
        rate = self._shares(t).rate
        T, way, turn = self._wide(rate, self._start, self._way, self._turn)
        share, out = move_runs_last(rate, 1), np.zeros((6, T.shape[-1]))
        out[:3] = share[0] * way
        for r in range(3):
            for c in range(3):
                out[3 + r] += T[r, c] * turn[c]  # the axis in base axes
        out[3:] *= share[1]
        return move_runs_first(out, rate.shape[:-1])

    def _shares(self, t: Any) -> TimeLawShares:
        """Return the shares (..., 2) of distance and angle, for all times and motions."""
        found, lead = self._timing.at(check_times(t)), self._lead
        shape = (*np.broadcast_shapes(found.s.shape[:-1], lead), 2)
        return TimeLawShares(*(np.broadcast_to(part, shape) for part in found))

    def _wide(self, like: Array, *parts: Array) -> tuple[Array, ...]:
        """Return parts (*lead, ...) broadcast to all times and motions, with the run last."""
        depth, lead = len(self._lead), like.shape[:-1]
        wide = (np.broadcast_to(part, (*lead, *part.shape[depth:])) for part in parts)
        return tuple(move_runs_last(part, part.ndim - len(lead)) for part in wide)

    @property
    def _lead(self) -> tuple[int, ...]:
        return np.broadcast_shapes(self.start.matrix.shape[:-2], self.end.matrix.shape[:-2])

    @cached_property
    def _start(self) -> Array:
        """The start poses (*lead, 3, 4)."""
        return np.broadcast_to(self.start.matrix[..., :3, :], (*self._lead, 3, 4))

    @cached_property
    def _end(self) -> Array:
        """The end poses (*lead, 3, 4)."""
        return np.broadcast_to(self.end.matrix[..., :3, :], (*self._lead, 3, 4))

    @cached_property
    def _way(self) -> Array:
        """The displacement (*lead, 3) in metres, in base axes."""
        return np.asarray(self._end[..., 3] - self._start[..., 3])

    @cached_property
    def _turn(self) -> Array:
        """The rotation vector (*lead, 3) from start to end, in axes of the start."""
        T0, T1 = (move_runs_last(T, 2) for T in (self._start, self._end))
        runs = T0.shape[-1]
        back, between, quaternion = np.empty(T0.shape), np.empty(T0.shape), np.empty((4, runs))
        turn = np.empty((3, runs))
        kernels.rotation_in_start_axes(T0, T1, back, between, quaternion, turn)
        return move_runs_first(turn, self._lead)

    @cached_property
    def _timing(self) -> Timing:
        """The timing of distance and angle."""
        ways = (euclidean_length(np.moveaxis(part, -1, 0)) for part in (self._way, self._turn))
        return self.pace.timing(*ways)


def _check_end_pose(value: Any, what: str) -> Pose:
    try:
        return Pose(as_pose(value).matrix)  # in the one base frame, whatever names it has
    except InputError as error:
        raise InputError(f"{what}: {error}") from None
