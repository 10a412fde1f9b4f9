"""Joints that turn about one axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.kernels.bodies import placing
from robsim.kernels.machine.stage import Stage
from robsim.robot.joints.kind import JointKind


@register("joint kind", "revolute")
@dataclass(frozen=True)
class Revolute(JointKind):
    """A joint that turns about z, by an angle in radians."""

    name: ClassVar[str] = "revolute"
    coordinates: ClassVar[tuple[str, ...]] = ("",)
    units: ClassVar[tuple[str, ...]] = ("rad",)
    moves: ClassVar[tuple[tuple[bool, int], ...]] = ((True, 2),)
    fused: ClassVar[Stage | None] = placing.turn
    turns: ClassVar[bool] = True
    follower: ClassVar[bool] = True
    rowed: ClassVar[bool] = True
