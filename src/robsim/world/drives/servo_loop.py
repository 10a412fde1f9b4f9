"""The base class of drives with a position loop around a velocity loop."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, align_runs, scale_runs
from robsim.base.errors import InputError
from robsim.declare import Number, PerRun
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.dynamics import joint_drives
from robsim.world.drives.drive_rows import DriveRows, count_whole_steps
from robsim.world.drives.joint_drive import FASTEST_LOOP, JointDrive

Bandwidth = Annotated[
    float,
    Number(above=0, most=FASTEST_LOOP, unit="1/s"),
    PerRun(()),
    "Bandwidth of the velocity loop in rad/s, at the believed inertia of each joint at home.",
]
IntegralRate = Annotated[
    float,
    Number(least=0, most=FASTEST_LOOP, unit="1/s"),
    PerRun(()),
    "Ratio of the integral gain to the gain of the velocity loop, in 1/s. 0: no integral, and a "
    "rest error under a load.",
]
PositionGain = Annotated[
    float,
    Number(above=0, most=FASTEST_LOOP, unit="1/s"),
    PerRun(()),
    "Velocity per error of the position, in 1/s, well below the bandwidth.",
]


@dataclass(frozen=True)
class LoopNumbers:
    """Numbers of the loops of a drive, each one number or one for each run.

    Attributes
    ----------
    bandwidth : float or ndarray of shape (runs,)
        Gain k of the velocity loop per unit of inertia, in 1/s.
    integral_rate : float or ndarray of shape (runs,)
        Ratio of the gain i of the integral to k, in 1/s.
    position : float or ndarray of shape (runs,)
        Gain c of the position loop, in 1/s.
    feed_forward : float or ndarray of shape (runs,)
        Share f of the command that reaches the velocity loop.
    """

    bandwidth: float | Array
    integral_rate: float | Array = 0.0
    position: float | Array = 0.0
    feed_forward: float | Array = 1.0

    def scale(self, inertia: Array) -> Array:
        """Return the gains k, i, c and f, of shape (4, n) or (4, n, runs), at given inertias."""
        k = scale_runs(inertia, self.bandwidth, 1)
        one = np.ones(len(inertia))
        others = scale_runs(one, self.position, 1), scale_runs(one, self.feed_forward, 1)
        gains = align_runs(k, scale_runs(k, self.integral_rate, 1), *others, axes=1)
        return np.stack(np.broadcast_arrays(*gains))


class ServoLoop(JointDrive):
    """Base class of the built-in drives: a position loop around a velocity loop.

    The cascade (Siciliano, Sciavicco, Villani and Oriolo, Robotics, 2009, section 8.3) commands

        torque = k e + i int(e) + compensation,    e = f u + c (r - q) - v,

    with the command u, and the integral r of u since the start.
    """

    is_inverse: ClassVar[bool] = False  # whether the loops give accelerations of the model

    @property
    @abstractmethod
    def numbers(self) -> LoopNumbers:
        """The numbers of the loops."""

    @property
    def has_gravity(self) -> bool:
        """Whether the drive adds the believed gravity load."""
        return bool(getattr(self, "gravity", True))

    def settle(self, inertia: Array, load: Array, fed: Array) -> Array:
        """Return the gaps (n, runs) that hold the load that is not compensated at the start."""
        missing = load - fed if self.has_gravity else load
        k, i, c, _ = self.numbers.scale(inertia).reshape(4, len(inertia), -1)
        held = (i == 0.0) & (c > 0.0) & (not self.is_inverse)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(held, missing / (k * c), 0.0)

    def bind(self, rows: DriveRows, runs: NDArray[np.int64]) -> Callable[[], None]:
        """Return a function that adds the stages of the torques in a sub-step."""
        return _BoundLoop(self, rows).add

    def check(self, names: Sequence[str], seconds: float, parts: int) -> None:
        """Raise InputError if the period of the drive does not fit the control period."""
        self.count_held_substeps(seconds, parts)

    def count_held_substeps(self, seconds: float, parts: int) -> int:
        """Return the number of sub-steps for which a torque is held; InputError if it is broken."""
        period: float | None = getattr(self, "period", None)
        if period is None:
            return 1
        step = seconds / parts
        count = count_whole_steps(period, step)
        if not count or parts % count:
            raise InputError(
                f"period is {1e3 * period:g} ms: expected a number of steps of "
                f"{1e3 * step:g} ms that divides the control period of {1e3 * seconds:g} ms"
            )
        return count


class _BoundLoop:
    """Rows and stages of a servo loop in a program."""

    def __init__(self, drive: ServoLoop, rows: DriveRows) -> None:
        self.drive, self.rows, program, n = drive, rows, rows.program, rows.n
        self.held = drive.count_held_substeps(rows.seconds, rows.parts)
        gains = drive.numbers.scale(np.ones(n) if drive.is_inverse else rows.inertia)
        implicit = not (drive.is_inverse or self.held > 1)  # else the torque is sampled
        self.slope = program.numbers(gains[0] if implicit else np.zeros(n), 1)
        self.gains = program.numbers(gains, 2)
        self.integral = program.each(self._hold_load(gains))
        self.error, self.demand, self.sum = program.rows(n), program.rows(n), program.rows(n)
        self.share = program.constant(self.held / rows.parts)
        self.friction_share = program.number(drive.model.friction)

    def _hold_load(self, gains: Array) -> Array:
        """Return the integrals (n, runs) that hold the load at the start."""
        missing = self.rows.load - (self.rows.fed if self.drive.has_gravity else 0.0)
        i = gains[1].reshape(self.rows.n, -1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.ascontiguousarray(np.where(i > 0.0, missing / i, 0.0 * missing))

    def add(self) -> None:
        """Add the stages of the torques in a sub-step."""
        rows, add = self.rows, self.rows.program.add
        state = {"command": rows.command, "v": rows.v, "gap": rows.gap, "integral": self.integral}
        results = {"error": self.error, "demand": self.demand}
        add(joint_drives.servo_joints, gains=self.gains, **state, **results)
        self._compensate()
        add(copy_rows, rows=self.sum, to=rows.torque)
        add(copy_rows, rows=self.slope, to=rows.slope)
        rows.limit(self.share)
        torques = {"demand": self.sum, "torque": rows.torque}
        sums = {"error": self.error, "integral": self.integral}
        add(joint_drives.integrate_servo_error, h=rows.h, held=self.held, **torques, **sums)

    def _compensate(self) -> None:
        """Add the stages of the sum of the loops' torques and of the compensations."""
        drive, rows, add = self.drive, self.rows, self.rows.program.add
        if drive.is_inverse:
            rows.believed.add_inverse(self.demand, self.sum)
        elif drive.has_gravity:
            rows.believed.add_gravity(self.sum)
            add(joint_drives.add_torques, more=self.demand, torque=self.sum)
        else:
            add(copy_rows, rows=self.demand, to=self.sum)
        if np.any(drive.model.friction):
            friction = {"damping": rows.damping, "friction": rows.friction}
            fed = {"share": self.friction_share, "torque": self.sum}
            add(joint_drives.feed_friction_forward, command=rows.command, **friction, **fed)
