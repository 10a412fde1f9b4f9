"""The joint that does not move."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.robot.joints.joint_kind import JointKind


@register("joint kind", "fixed")
@dataclass(frozen=True)
class FixedJoint(JointKind):
    """A joint that does not move."""

    name = "fixed"
    rowed = True
    fused = None  # it is folded into the constants of other joints
