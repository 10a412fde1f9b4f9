"""Regions of poses that samplers describe, for robots that do not reach every pose.

A region measures how far poses are from a drawn pose, in errors of several priorities, and whether
poses are within its bounds. Errors have no unit: lengths are in units of a length of the region.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, euclidean_length
from robsim.geometry.look_at import look_at_rotation
from robsim.geometry.pose import Pose

BOUND_SLACK = 1e-6  # metres and radians by which rounding may violate a bound


class BoundedQuantity(NamedTuple):
    """A quantity (n,) of some poses, with its name, its unit "m" or "rad", and its bounds.

    `excused` is whether a robot with too few joints may violate the bounds.
    """

    name: str
    unit: str
    values: Array
    low: float
    high: float
    excused: bool = False

    @property
    def within(self) -> NDArray[np.bool_]:
        """Whether each value is within the bounds."""
        above, below = self.values >= self.low - BOUND_SLACK, self.values <= self.high + BOUND_SLACK
        return np.asarray(above & below)


class PoseRegion(Protocol):
    """The poses that a sampler may draw."""

    def errors(self, T: Array, drawn: Array) -> list[Array]:
        """Return errors (n, k) of poses T (n, 4, 4) from drawn poses, the most important first."""

    def quantities(self, T: Array) -> list[BoundedQuantity]:
        """Return the quantities of poses T (n, 4, 4) that the region bounds."""


@dataclass(frozen=True, eq=False)
class LookRegion:
    """Poses of a camera that looks at a point; see `LookAt`."""

    middle: Array  # (3,), in the world
    axis: Array  # (3,), unit axis of the cone of directions
    upright: Array  # (3,), direction of the image columns without roll
    distance: Array  # least and largest
    cone: float
    roll: Array  # least and largest
    aside: float

    def errors(self, T: Array, drawn: Array) -> list[Array]:
        """Return the errors of optical axis and distance, of the direction, and of the rotation.

        The optical axis is to pass through the point of the drawn axis that is nearest to the
        middle.
        """
        offset, drawn_offset = T[:, :3, 3] - self.middle, drawn[:, :3, 3] - self.middle
        distance, drawn_distance = euclidean_length(offset.T), euclidean_length(drawn_offset.T)
        z = drawn[:, :3, 2]
        view = drawn_offset - _dot(drawn_offset, z)[:, None] * z
        x, y, depth = (_dot(view - offset, T[:, :3, i]) for i in range(3))
        aside = np.hypot(x, y)
        scale = np.arctan2(aside, depth) / np.where(aside > 0, aside, 1.0)
        ratio = np.log(distance / drawn_distance)
        direction = offset / distance[:, None] - drawn_offset / drawn_distance[:, None]
        turn = _rotation_difference(T, drawn)
        return [np.stack([scale * x, scale * y, ratio], axis=1), direction, turn]

    def quantities(self, T: Array) -> list[BoundedQuantity]:
        """Return distance, angle from the axis, roll, and distance of the optical axis."""
        offset, z = T[:, :3, 3] - self.middle, T[:, :3, 2]
        distance = euclidean_length(offset.T)
        away = euclidean_length(np.cross(offset / distance[:, None], self.axis).T)
        cone = np.arctan2(away, _dot(offset, self.axis) / distance)
        miss = euclidean_length(np.cross(offset, z).T)
        miss = np.where(_dot(offset, z) < 0, miss, distance)  # the point may be behind the camera
        upright = look_at_rotation(z, np.zeros(len(z)), self.upright)
        x, y = (_dot(upright[:, :, i], T[:, :3, 0]) for i in range(2))
        low, high = self.roll
        centre = 0.5 * (low + high)
        roll = centre + _wrap_angle(np.arctan2(y, x) - centre)
        return [
            BoundedQuantity("distance", "m", distance, *self.distance),
            BoundedQuantity("angle from the axis", "rad", cone, 0.0, self.cone),
            BoundedQuantity("roll", "rad", roll, low, high),
            BoundedQuantity(
                "distance of the optical axis from the middle", "m", miss, 0.0, self.aside, True
            ),
        ]


@dataclass(frozen=True, eq=False)
class ShellRegion:
    """Poses within bounds of distance and angle from a reference pose; see `Shell`."""

    reference: Pose
    distance: Array  # least and largest
    angle: Array

    def errors(self, T: Array, drawn: Array) -> list[Array]:
        """Return the errors of distance and angle, and of the pose."""
        length, largest_angle = (bounds[1] or 1.0 for bounds in (self.distance, self.angle))
        offset, turn = self._displacement(T, length)
        drawn_offset, drawn_turn = self._displacement(drawn, length)
        first = [
            _length_error(offset, drawn_offset, self.distance[1] > 0),
            _length_error(turn, drawn_turn, self.angle[1] > 0),
        ]
        pose = [offset - drawn_offset, _rotation_difference(T, drawn) / largest_angle]
        return [np.concatenate(first, axis=1), np.concatenate(pose, axis=1)]

    def _displacement(self, T: Array, length: float) -> tuple[Array, Array]:
        """Return offsets in units of a length, and rotation vectors, from the reference pose."""
        reference = np.broadcast_to(self.reference.matrix, T.shape)
        return (T - reference)[:, :3, 3] / length, _rotation_difference(T, reference)

    def quantities(self, T: Array) -> list[BoundedQuantity]:
        """Return the distance and the angle from the reference pose."""
        offset, turn = (euclidean_length(each.T) for each in self._displacement(T, 1.0))
        return [
            BoundedQuantity("distance", "m", offset, *self.distance),
            BoundedQuantity("angle", "rad", turn, *self.angle),
        ]


@dataclass(frozen=True, eq=False)
class BoxRegion:
    """Poses in a box about a reference pose; see `About`."""

    reference: Pose
    bounds: Array  # (6,), of the offsets, and of roll, pitch and yaw

    def errors(self, T: Array, drawn: Array) -> list[Array]:
        """Return the errors of coordinates that the box fixes, and of the others."""
        error = self._coordinates(T) - self._coordinates(drawn)
        error[:, 3:] = _wrap_angle(error[:, 3:])
        fixed = self.bounds == 0
        length = self.bounds[:3].max() or 1.0
        error[:, :3] /= np.where(fixed[:3], length, 1.0)
        error[:, ~fixed] /= self.bounds[~fixed]
        return [error[:, chosen] for chosen in (fixed, ~fixed) if chosen.any()]

    def quantities(self, T: Array) -> list[BoundedQuantity]:
        """Return the offsets along the axes of the reference pose, and roll, pitch and yaw."""
        names = (
            ("x", "m"),
            ("y", "m"),
            ("z", "m"),
            ("roll", "rad"),
            ("pitch", "rad"),
            ("yaw", "rad"),
        )
        values = self._coordinates(T).T
        return [
            BoundedQuantity(*name, each, -bound, bound)
            for name, each, bound in zip(names, values, self.bounds.tolist(), strict=True)
        ]

    def _coordinates(self, T: Array) -> Array:
        """Return the offsets, and roll, pitch and yaw (n, 6), of poses T (n, 4, 4)."""
        offset, R0 = T[:, :3, 3] - self.reference.position, self.reference.rotation
        x, y, z = (_dot(offset, R0[:, i]) for i in range(3))
        r = [[_dot(R0[:, i], T[:, :3, j]) for j in range(3)] for i in range(3)]
        pitch = np.arctan2(-r[2][0], np.hypot(r[0][0], r[1][0]))
        roll, yaw = np.arctan2(r[2][1], r[2][2]), np.arctan2(r[1][0], r[0][0])
        return np.stack([x, y, z, roll, pitch, yaw], axis=1)


def _dot(a: Array, b: Array) -> Array:
    """Return the dot products of vectors (..., 3), summed in a fixed order."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def _wrap_angle(angle: Array) -> Array:
    """Return equivalent angles in [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _rotation_difference(T: Array, reference: Array) -> Array:
    """Return the rotation vectors (n, 3) from reference poses to poses (n, 4, 4)."""
    R = np.zeros(T.shape)
    for i in range(3):
        for j in range(3):
            R[:, i, j] = _dot(T[:, i, :3], reference[:, j, :3])
    R[:, 3, 3] = 1.0
    return Pose(R).rotvec


def _length_error(vector: Array, drawn: Array, has_length: bool) -> Array:
    """Return the error (n, 1) of a length, or the vectors (n, 3) if the length is to be zero."""
    if not has_length:
        return vector
    return np.asarray(euclidean_length(vector.T) - euclidean_length(drawn.T))[:, None]
