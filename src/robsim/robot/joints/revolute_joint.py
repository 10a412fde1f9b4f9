"""Joints that turn about one axis."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.joint_kind import JointKind


@register("joint kind", "revolute")
@dataclass(frozen=True)
class RevoluteJoint(JointKind):
    """Joint that turns about z, by an angle in radians."""

    name = "revolute"
    coordinates = ("",)
    units = ("rad",)
    moves = ((True, 2),)
    fused = forward_kinematics.place_revolute
    turns = True
    follower = True
    rowed = True
