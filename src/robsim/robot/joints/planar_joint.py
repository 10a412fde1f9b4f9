"""Joints that move in a plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, euclidean_length
from robsim.declare import register
from robsim.kernels.bodies import forward_kinematics, integration
from robsim.robot.joints.joint_kind import SAMPLE_REACH, JointKind, wrap_magnitude


class PlanarKind(JointKind):
    """Base class of kinds with the first coordinates x, y and heading theta in the plane z = 0."""

    fused = forward_kinematics.place_planar
    moving = integration.integrate_planar_body
    moved = 3
    roams = True

    def sample(self, share: Array, home: Array, limits: Array) -> Array:
        """Return random positions around home, at any heading; other coordinates stay at home."""
        q = np.tile(home, (len(share), 1))
        q[:, :3] += (2.0 * share[:, :3] - 1.0) * [SAMPLE_REACH, SAMPLE_REACH, np.pi]
        return q

    def distance(self, a: Array, b: Array) -> Array:
        """Return the larger of the distance in m and the turn in rad of coordinates (..., n)."""
        offset = euclidean_length(np.moveaxis(a[..., :2] - b[..., :2], -1, 0))
        return np.maximum(offset, wrap_magnitude(a[..., 2] - b[..., 2]))


@register("joint kind", "planar")
@dataclass(frozen=True)
class PlanarJoint(PlanarKind):
    """Joint that moves in the plane z = 0.

    Its coordinates are x, y and theta, and its velocities are vx, vy and omega.
    """

    name = "planar"
    coordinates = (".x", ".y", ".theta")
    units = ("m", "m", "rad")
    velocities = (".vx", ".vy", ".omega")
    moves = ((False, 0), (False, 1), (True, 2))
