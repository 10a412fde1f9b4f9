"""Joints that follow a curve."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from robsim.declare import register
from robsim.geometry.curves import Curve
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.joint_kind import BodyRows, JointKind


@register("joint kind", "rail")
@dataclass(frozen=True)
class Rail(JointKind):
    """Joint that follows the `curve` of its `Joint`, with x tangent, by an arc length in metres."""

    name = "rail"
    coordinates = ("",)
    units = ("m",)
    moves = ((False, 0),)  # the turn by the curvature is added separately
    fused = forward_kinematics.place_on_rail
    follower = True
    needs = "curve"

    def span(self, part: Curve) -> tuple[float, float]:
        """Return the arc lengths of the ends of the curve."""
        return 0.0, part.length

    def add_placing(self, placed: Any, bodies: Iterable[BodyRows]) -> None:
        """Add the stages that place bodies on their curves and compute the curvature as a ratio.

        If the rail follows another coordinate, the curvature is per unit of that coordinate.
        """
        for parent, place, s, T, body in bodies:
            given = {"curve": body.curve, "parent": parent, "place": place, "s": s, "T": T}
            bend = placed.ratio[body.bend]
            placed.program.add(
                forward_kinematics.place_on_rail, **placed.curves, **given, curvature=bend
            )
            if body.slope:
                placed.program.add(
                    forward_kinematics.scale_curvature,
                    curvature=bend,
                    slope=placed.ratio[body.slope],
                )
