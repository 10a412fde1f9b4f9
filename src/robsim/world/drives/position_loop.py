"""Drives with a position loop around a velocity loop on each joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.declare import Number, PerRun, register
from robsim.world.drives.joint_drive import TRUE_MODEL, GravityFed, Model, TorqueLimit
from robsim.world.drives.servo_loop import (
    Bandwidth,
    IntegralRate,
    LoopNumbers,
    PositionGain,
    ServoLoop,
)


@register("drive", "position_loop")
@dataclass(frozen=True, eq=False)
class PositionLoop(ServoLoop):
    """Position loop around a velocity loop on each joint, which follows the integral of commands.

        torque = b D (e + j int(e)) + g(q),    e = f u + c (r - q) - v,

    with the bandwidth b, the rate j of the integral, the diagonal D of the believed mass matrix at
    home, the gain c of the position, the share f of the command u, and the integral r of u.
    Without feed-forward (f = 0) the joint follows r late, by the time 1/c.

    Examples
    --------
    >>> import robsim as rs
    >>> rs.drives.PositionLoop(position_gain=20.0, feed_forward=0.0).bandwidth
    100.0
    """

    position_gain: PositionGain = 20.0
    bandwidth: Bandwidth = 100.0
    integral_rate: IntegralRate = 10.0
    feed_forward: Annotated[
        float,
        Number(least=0, most=1),
        PerRun(()),
        "Share of the command that reaches the velocity loop.",
    ] = 1.0
    gravity: GravityFed = True
    model: Model = TRUE_MODEL
    torque_limit: TorqueLimit = None

    @property
    def numbers(self) -> LoopNumbers:
        return LoopNumbers(
            self.bandwidth, self.integral_rate, self.position_gain, self.feed_forward
        )
