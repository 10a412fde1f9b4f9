"""Joint with six degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, euclidean_length
from robsim.base.errors import InputError
from robsim.declare import register
from robsim.geometry.rotation import random_quaternions
from robsim.kernels.bodies import forward_kinematics, integration
from robsim.robot.joints.joint_kind import SAMPLE_REACH, JointKind


@register("joint kind", "floating")
@dataclass(frozen=True)
class FloatingJoint(JointKind):
    """Joint that moves freely, with a position and a unit quaternion (x, y, z, w) as coordinates.

    Its velocity is the body twist (v, omega).
    """

    name = "floating"
    coordinates = (".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw")
    units = ("m",) * 3 + ("1",) * 4
    velocities = (".vx", ".vy", ".vz", ".wx", ".wy", ".wz")
    rates = ("m/s",) * 3 + ("rad/s",) * 3
    moves = tuple((turns, axis) for turns in (False, True) for axis in range(3))
    fused = forward_kinematics.place_floating
    moving = integration.integrate_floating_body
    roams = True
    free = True

    @property
    def rest(self) -> Array:
        """Coordinates (7,) of the identity."""
        return np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])

    def checked(self, q: Array, what: str, name: str) -> Array:
        """Return q (..., 7) with its quaternion normalized; raise InputError if it is far off."""
        size = np.linalg.norm(q[..., 3:], axis=-1, keepdims=True)
        if (np.abs(size - 1) > 1e-6).any():
            raise InputError(f"{what}: the quaternion of '{name}' must have length 1")
        if (np.abs(size - 1) <= 1e-12).all():  # exact values are not changed
            return q
        return np.concatenate([q[..., :3], q[..., 3:] / size], axis=-1)

    def sample(self, share: Array, home: Array, limits: Array) -> Array:
        """Return random positions, uniform around home, and rotations, uniform over SO(3)."""
        place = home[:3] + SAMPLE_REACH * (2.0 * share[:, :3] - 1.0)
        return np.concatenate([place, random_quaternions(share[:, 3:6])], axis=1)

    def between(self, a: Array, b: Array, share: Array) -> Array:
        """Return poses between a and b (B, 7), on the shorter rotation."""
        b = b.copy()
        opposite = (a[:, 3:] * b[:, 3:]).sum(axis=1) < 0  # q and -q are the same rotation
        b[:, 3:] *= np.where(opposite, -1.0, 1.0)[:, None]
        q = super().between(a, b, share)
        q[:, 3:] /= euclidean_length(q[:, 3:].T)[:, None]
        return q

    def distance(self, a: Array, b: Array) -> Array:
        """Return the larger of the distance in m and the angle in rad between poses (..., 7)."""
        place, turn, against = (
            euclidean_length(np.moveaxis(difference, -1, 0))
            for difference in (
                a[..., :3] - b[..., :3],
                a[..., 3:] - b[..., 3:],
                a[..., 3:] + b[..., 3:],
            )
        )
        # |a -+ b| = 2 sin(angle/4), for the sign with the smaller result
        angle = 4.0 * np.arcsin(np.minimum(0.5 * np.minimum(turn, against), 1.0))
        return np.maximum(place, angle)
