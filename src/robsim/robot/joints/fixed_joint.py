"""Joint without motion."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.robot.joints.joint_kind import JointKind


@register("joint kind", "fixed")
@dataclass(frozen=True)
class FixedJoint(JointKind):
    """Joint without motion."""

    name = "fixed"
    rowed = True
    fused = None  # fixed joints are folded into the constants of other joints
