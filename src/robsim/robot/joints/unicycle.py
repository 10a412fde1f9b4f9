"""Vehicles that drive and turn on the spot, and cannot move sideways."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.declare import register
from robsim.robot.joints.planar_joint import PlanarKind


@register("joint kind", "unicycle")
@dataclass(frozen=True)
class Unicycle(PlanarKind):
    """Vehicle that turns on the spot and cannot move sideways.

    Its coordinates are x, y and theta, and its velocities are v along x and omega about z.
    """

    name = "unicycle"
    coordinates = (".x", ".y", ".theta")
    units = ("m", "m", "rad")
    velocities = (".v", ".omega")
    rates = ("m/s", "rad/s")
    moves = ((False, 0), (True, 2))
    wheeled = True
