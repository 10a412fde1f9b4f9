"""Drives with a velocity loop on each joint."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.world.drives.joint_drive import TRUE_MODEL, GravityFed, Model, TorqueLimit
from robsim.world.drives.servo_loop import Bandwidth, IntegralRate, LoopNumbers, ServoLoop


@register("drive", "velocity_loop")
@dataclass(frozen=True, eq=False)
class VelocityLoop(ServoLoop):
    """Velocity loop on each joint, proportional or with an integral.

        torque = b D (e + j int(e)) + g(q),    e = u - v,

    with the bandwidth b, the rate j of the integral, the command u, and the diagonal D of the
    believed mass matrix at home. Without the gravity load g, the integral carries the weight.
    Without the integral, a joint sags at the velocity g/(b D), against which the task needs a rest
    error.

    Examples
    --------
    >>> import robsim as rs
    >>> drive = rs.drives.VelocityLoop(bandwidth=50, integral_rate=0)
    >>> rs.Actuation(drive=drive).drive.gravity
    True
    """

    bandwidth: Bandwidth = 100.0
    integral_rate: IntegralRate = 10.0
    gravity: GravityFed = True
    model: Model = TRUE_MODEL
    torque_limit: TorqueLimit = None

    @property
    def numbers(self) -> LoopNumbers:
        return LoopNumbers(self.bandwidth, self.integral_rate)
