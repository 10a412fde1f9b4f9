"""Joints that follow a curve."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from robsim.declare import register
from robsim.geometry.curves import Curve
from robsim.kernels.bodies import forward_kinematics
from robsim.robot.joints.joint_kind import BodyRows, JointKind, KinematicsRows


@register("joint kind", "rail")
@dataclass(frozen=True)
class Rail(JointKind):
    """Joint that moves along the `curve` of its `Joint`, with x tangent to the curve.

    Its coordinate is the arc length in metres.
    """

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

    def add_placing(self, rows: KinematicsRows, bodies: Iterable[BodyRows]) -> None:
        """Add the stages that place bodies on their curves and compute the curvature as a ratio.

        If the rail follows another coordinate, the curvature is per unit of that coordinate.
        """
        for parent, place, s, T, body in bodies:
            numbers = {"which": body.curve, "parent": parent, "place": place, "s": s, "T": T}
            bend = rows.ratio[body.bend]
            rows.program.add(
                forward_kinematics.place_on_rail, **rows.curves, **numbers, curvature=bend
            )
            if body.slope:
                rows.program.add(
                    forward_kinematics.scale_curvature, curvature=bend, slope=rows.ratio[body.slope]
                )
