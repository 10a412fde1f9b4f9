"""Joints that slide along one axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.kernels.bodies import placing
from robsim.kernels.machine.stage import Stage
from robsim.robot.joints.kind import JointKind


@register("joint kind", "prismatic")
@dataclass(frozen=True)
class Prismatic(JointKind):
    """A joint that slides along z, by a distance in metres."""

    name: ClassVar[str] = "prismatic"
    coordinates: ClassVar[tuple[str, ...]] = ("",)
    units: ClassVar[tuple[str, ...]] = ("m",)
    moves: ClassVar[tuple[tuple[bool, int], ...]] = ((False, 2),)
    fused: ClassVar[Stage | None] = placing.slide
    follower: ClassVar[bool] = True
    rowed: ClassVar[bool] = True
