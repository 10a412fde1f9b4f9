"""Joints that slide along one axis."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.kernels.bodies import placing
from robsim.robot.joints.kind import JointKind


@register("joint kind", "prismatic")
@dataclass(frozen=True)
class Prismatic(JointKind):
    """A joint that slides along z, by a distance in metres."""

    name = "prismatic"
    coordinates = ("",)
    units = ("m",)
    moves = ((False, 2),)
    fused = placing.slide
    follower = True
    rowed = True
