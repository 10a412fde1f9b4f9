"""Vehicles that drive and turn on the spot, and cannot move sideways."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from robsim.declare import register
from robsim.robot.joints.planar import InPlane


@register("joint kind", "unicycle")
@dataclass(frozen=True)
class Unicycle(InPlane):
    """A vehicle that cannot move sideways; q is x, y, theta, v is (v along x, omega about z)."""

    name: ClassVar[str] = "unicycle"
    coordinates: ClassVar[tuple[str, ...]] = (".x", ".y", ".theta")
    units: ClassVar[tuple[str, ...]] = ("m", "m", "rad")
    velocities: ClassVar[tuple[str, ...]] = (".v", ".omega")
    rates: ClassVar[tuple[str, ...]] = ("m/s", "rad/s")
    moves: ClassVar[tuple[tuple[bool, int], ...]] = ((False, 0), (True, 2))
    wheeled: ClassVar[bool] = True
