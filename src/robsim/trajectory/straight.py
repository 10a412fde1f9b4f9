"""Straight motions of a frame, with rotation about a fixed axis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, euclidean_length, move_runs_first, move_runs_last
from robsim.base.errors import InputError
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value
from robsim.declare.context import Context
from robsim.geometry.pose import (
    Pose,
    PoseLike,
    as_pose,
    broadcast_leading_shape,
    homogeneous_matrix,
)
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
    """Text form of a straight motion."""

    start: Annotated[Pose, POSE, "Pose at the start."]
    end: Annotated[Pose, POSE, "Pose at the end."]
    duration: Duration = None
    speed: OriginSpeed = None
    acceleration: OriginAcceleration = None
    turn: TurnRate = None
    turn_acceleration: TurnAcceleration = None

    def build_value(self, c: Context) -> Straight:
        """Return the motion that the table describes."""
        return Straight(**vars(self))

    @classmethod
    def of(cls, value: Straight, c: Context) -> StraightTable:
        """Return the table that describes a motion."""
        return cls(value.start, value.end, **vars(value.pace))


@name_parameters
@dataclass(frozen=True, eq=False, init=False)
class Straight(Value):
    """Straight motion of a frame from one pose to another, with rotation about a fixed axis.

    While the fraction s of the motion grows from 0 to 1, the origin p and the orientation R are

        p = (1 - s) p_start + s p_end,    R = R_start exp(s [theta u]),

    with the rotation vector theta u from start to end, in axes of the start (spherical linear
    interpolation: Shoemake 1985; Siciliano et al. 2009, section 4.3.3). For a rotation by half a
    turn, both directions are equally short, and one of them is chosen.

    Give either the duration, for a minimum-jerk motion as in `Quintic`, or limits, for the fastest
    motion within them as in `Trapezoid`. The speed and acceleration limit the origin, the turn rate
    and turn acceleration the orientation.

    Parameters
    ----------
    start, end : Pose or array_like of shape (..., 4, 4)
        Poses in one base frame. Batches describe several motions at once, which are broadcast
        against the times.
    duration : float, optional
        Duration in seconds.
    speed, acceleration : float, optional
        Limits of the origin in m/s and m/s^2, both or none.
    turn, turn_acceleration : float, optional
        Limits of the orientation in rad/s and rad/s^2, both or none.

    Attributes
    ----------
    start, end : Pose
        Poses without frame names.
    pace : Pace
        Duration or limits.

    Raises
    ------
    InputError
        If neither or both of duration and limits are given, or a limit is missing for a part of the
        motion.

    Examples
    --------
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
        start: PoseLike,
        end: PoseLike,
        duration: float | None = None,
        *,
        speed: float | None = None,
        acceleration: float | None = None,
        turn: float | None = None,
        turn_acceleration: float | None = None,
    ):
        put = object.__setattr__
        put(self, "start", _check_end_pose(start, "start"))
        put(self, "end", _check_end_pose(end, "end"))
        broadcast_leading_shape(
            self.start.matrix.shape[:-2], self.end.matrix.shape[:-2], "start and end"
        )
        put(self, "pace", Pace(duration, speed, acceleration, turn, turn_acceleration))
        _ = self._timing  # raises if a limit is missing

    @property
    def duration(self) -> float | Array:
        """Duration in seconds, (...) for several motions."""
        seconds = self._timing.seconds
        return seconds if seconds.ndim else float(seconds)

    def at(self, t: ArrayLike) -> Array:
        """Return poses (..., 4, 4) in the base frame at times t (...) in seconds."""
        s = self._shares(t).s
        T, displacement, turn, end = self._wide(
            s, self._start, self._displacement, self._turn, self._end
        )
        runs = T.shape[-1]
        twist, step, out = np.empty((6, runs)), np.empty(T.shape), np.empty(T.shape)
        kernels.interpolate_pose(T, displacement, turn, move_runs_last(s, 1), end, twist, step, out)
        return homogeneous_matrix(out, s.shape[:-1])

    def twist(self, t: ArrayLike) -> Array:
        """Return twists (..., 6) = (v, omega) in m/s and rad/s, in base axes, at times t (...)."""
        rate = self._shares(t).rate
        T, displacement, turn = self._wide(rate, self._start, self._displacement, self._turn)
        share, out = move_runs_last(rate, 1), np.zeros((6, T.shape[-1]))
        out[:3] = share[0] * displacement
        for r in range(3):
            for c in range(3):
                out[3 + r] += T[r, c] * turn[c]  # the axis in base axes
        out[3:] *= share[1]
        return move_runs_first(out, rate.shape[:-1])

    def _shares(self, t: ArrayLike) -> TimeLawShares:
        """Return the fractions (..., 2) of distance and angle, for all times and motions."""
        shares, lead = self._timing.at(check_times(t)), self._lead
        shape = (*np.broadcast_shapes(shares.s.shape[:-1], lead), 2)
        return TimeLawShares(*(np.broadcast_to(part, shape) for part in shares))

    def _wide(self, like: Array, *parts: Array) -> tuple[Array, ...]:
        """Return parts (*lead, ...) broadcast to all times and motions, with the run last."""
        depth, lead = len(self._lead), like.shape[:-1]
        wide = (np.broadcast_to(part, (*lead, *part.shape[depth:])) for part in parts)
        return tuple(move_runs_last(part, part.ndim - len(lead)) for part in wide)

    @property
    def _lead(self) -> tuple[int, ...]:
        """Leading shape of start and end, broadcast."""
        return np.broadcast_shapes(self.start.matrix.shape[:-2], self.end.matrix.shape[:-2])

    @cached_property
    def _start(self) -> Array:
        """Start poses (*lead, 3, 4)."""
        return np.broadcast_to(self.start.matrix[..., :3, :], (*self._lead, 3, 4))

    @cached_property
    def _end(self) -> Array:
        """End poses (*lead, 3, 4)."""
        return np.broadcast_to(self.end.matrix[..., :3, :], (*self._lead, 3, 4))

    @cached_property
    def _displacement(self) -> Array:
        """Displacement (*lead, 3) in metres, in base axes."""
        return np.asarray(self._end[..., 3] - self._start[..., 3])

    @cached_property
    def _turn(self) -> Array:
        """Rotation vector (*lead, 3) in radians from start to end, in axes of the start."""
        T0, T1 = (move_runs_last(T, 2) for T in (self._start, self._end))
        runs = T0.shape[-1]
        back, between, quaternion = np.empty(T0.shape), np.empty(T0.shape), np.empty((4, runs))
        turn = np.empty((3, runs))
        kernels.rotation_in_start_axes(T0, T1, back, between, quaternion, turn)
        return move_runs_first(turn, self._lead)

    @cached_property
    def _timing(self) -> Timing:
        """Timing of distance and angle."""
        lengths = (
            euclidean_length(np.moveaxis(part, -1, 0)) for part in (self._displacement, self._turn)
        )
        return self.pace.timing(*lengths)


def _check_end_pose(value: PoseLike, what: str) -> Pose:
    """Return poses without frame names; raise an InputError that names `what` for other values."""
    try:
        return Pose(as_pose(value).matrix)
    except InputError as error:
        raise InputError(f"{what}: {error}") from None
