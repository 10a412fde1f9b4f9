"""Sampled servo drives of industrial arms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.errors import InputError
from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.declare import Number, PerRun, Time, register
from robsim.world.drives.joint_drive import FASTEST_LOOP, TRUE_MODEL, Model, TorqueLimit
from robsim.world.drives.servo_loop import IntegralRate, LoopNumbers, PositionGain, ServoLoop


@register("drive", "industrial_servo")
@dataclass(frozen=True, eq=False)
class IndustrialServo(ServoLoop):
    """Servo drive of an industrial arm: sampled loops of each joint, without a model of the arm.

    A position loop with feed-forward surrounds a velocity loop with an integral, which carries the
    weight, the couplings and the friction. The drive computes torques once in a `period` and holds
    them. Currents limit its torques: the efforts of the joints, or `torque_limit`. Armature and
    friction are properties of the joints.

    Examples
    --------
    >>> import robsim as rs
    >>> rs.drives.IndustrialServo(period=0.004).has_gravity
    False
    """

    bandwidth: Annotated[
        float,
        Number(above=0, most=FASTEST_LOOP, unit="1/s"),
        PerRun(()),
        "Bandwidth of the velocity loop in rad/s, at the believed inertia of each joint at home.",
    ] = 100.0
    integral_rate: IntegralRate = 20.0
    position_gain: PositionGain = 20.0
    period: Annotated[float, Time(above=0), "Period of the drive, which holds its torques."] = 0.002
    model: Model = TRUE_MODEL
    torque_limit: TorqueLimit = None

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_milliseconds(self.period, "IndustrialServo.period")
        if self.model.payload or np.any(np.not_equal(self.model.gravity, 1.0)):
            raise InputError(
                "IndustrialServo.model: the drive compensates neither gravity nor payloads; give "
                "mass and friction alone"
            )

    @property
    def numbers(self) -> LoopNumbers:
        return LoopNumbers(self.bandwidth, self.integral_rate, self.position_gain)

    @property
    def has_gravity(self) -> bool:
        """Whether the drive adds the believed gravity load: it does not."""
        return False
