"""Drives with proportional and derivative terms: gravity compensation and computed torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import Number, PerRun, register
from robsim.world.drives.joint_drive import FASTEST_LOOP, TRUE_MODEL, Model, TorqueLimit
from robsim.world.drives.servo_loop import LoopNumbers, ServoLoop

Frequency = Annotated[
    float,
    Number(above=0, most=FASTEST_LOOP, unit="1/s"),
    PerRun(()),
    "Natural frequency of each joint in rad/s.",
]
DampingRatio = Annotated[
    float, Number(above=0), PerRun(()), "Damping ratio of each joint; 1 is critical damping."
]


class SecondOrderLoop(ServoLoop):
    """Base class of drives that give each joint a natural frequency and a damping ratio."""

    frequency: float
    damping_ratio: float

    @property
    def numbers(self) -> LoopNumbers:
        """The numbers of the loops: k = 2 z w and k c = w^2."""
        rate = 2.0 * self.damping_ratio * self.frequency
        return LoopNumbers(rate, 0.0, self.frequency / (2.0 * self.damping_ratio))


@register("drive", "gravity_compensated_pd")
@dataclass(frozen=True, eq=False)
class GravityCompensatedPD(SecondOrderLoop):
    """Proportional and derivative control of each joint, with gravity compensation.

        torque = D (w^2 (r - q) + 2 z w (u - v)) + g(q)

    (Takegaki and Arimoto 1981, "A new feedback method for dynamic control of manipulators"), with
    the natural frequency w, the damping ratio z, the command u, its integral r, the gravity load g,
    and the diagonal D of the believed mass matrix at home.

    Examples
    --------
    >>> import robsim as rs
    >>> rs.drives.GravityCompensatedPD(frequency=30.0).damping_ratio
    1.0
    """

    frequency: Frequency = 50.0
    damping_ratio: DampingRatio = 1.0
    model: Model = TRUE_MODEL
    torque_limit: TorqueLimit = None


@register("drive", "computed_torque")
@dataclass(frozen=True, eq=False)
class ComputedTorque(SecondOrderLoop):
    """Computed torque: the believed model turns demanded accelerations into torques.

        torque = M(q) (w^2 (r - q) + 2 z w (u - v)) + c(q, v) + g(q)

    (Luh, Walker and Paul 1980, "Resolved-acceleration control of mechanical manipulators"; Craig,
    Introduction to Robotics, section 10.4), with the believed mass matrix M, Coriolis and
    centrifugal torques c, and gravity load g. With a true model all joints respond alike, with the
    natural frequency w and the damping ratio z.

    Examples
    --------
    >>> import robsim as rs
    >>> model = rs.drives.DriveModel(mass=0.8)
    >>> rs.drives.ComputedTorque(frequency=30.0, model=model).model.mass
    0.8
    """

    is_inverse: ClassVar[bool] = True
    frequency: Frequency = 50.0
    damping_ratio: DampingRatio = 1.0
    model: Model = TRUE_MODEL
    torque_limit: TorqueLimit = None
