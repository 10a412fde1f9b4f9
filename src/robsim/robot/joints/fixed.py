"""The joint that does not move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.kernels.machine.stage import Stage
from robsim.robot.joints.kind import JointKind


@register("joint kind", "fixed")
@dataclass(frozen=True)
class Fixed(JointKind):
    """A joint that does not move."""

    name: ClassVar[str] = "fixed"
    rowed: ClassVar[bool] = True
    fused: ClassVar[Stage | None] = None  # it is folded into the constants of other joints
