"""Joints that follow a curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.geometry.curves import Curve
from robsim.kernels.formulas import joints as kernels
from robsim.robot.joints.kind import JointKind


@register("joint kind", "rail")
@dataclass(frozen=True)
class Rail(JointKind):
    """A joint that follows the `curve` of its `Joint`, x along it, by an arc length in metres."""

    name: ClassVar[str] = "rail"
    coordinates: ClassVar[tuple[str, ...]] = ("",)
    units: ClassVar[tuple[str, ...]] = ("m",)
    moves: ClassVar[tuple[tuple[bool, int], ...]] = ((False, 0),)  # and the bend of the curve
    code: ClassVar[int] = kernels.RAIL
    follower: ClassVar[bool] = True
    needs: ClassVar[str | None] = "curve"

    def span(self, part: Curve) -> tuple[float, float]:
        """Return the arc lengths of the ends of the curve."""
        return 0.0, part.length
