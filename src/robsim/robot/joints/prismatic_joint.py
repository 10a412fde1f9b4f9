"""Joints that slide along one axis."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.joint_kind import JointKind


@register("joint kind", "prismatic")
@dataclass(frozen=True)
class PrismaticJoint(JointKind):
    """Joint that slides along z, by a distance in metres."""

    name = "prismatic"
    coordinates = ("",)
    units = ("m",)
    moves = ((False, 2),)
    fused = forward_kinematics.place_prismatic
    follower = True
    rowed = True
