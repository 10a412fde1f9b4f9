"""Directions in a cone, and rotations of a camera that looks along given directions."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array


def sample_cone_directions(axis: Array, cone: float, along: Array, around: Array) -> Array:
    """Return unit vectors (B, 3), uniform on the sphere within an angle of an axis (3,).

    Parameters
    ----------
    axis : ndarray of shape (3,)
        Unit axis of the cone.
    cone : float
        Half angle of the cone, in radians.
    along, around : ndarray of shape (B,)
        Uniform numbers in (0, 1) that choose the height along the axis and the angle about it.
    """
    height = np.cos(cone) + (1.0 - np.cos(cone)) * along
    angle = np.pi * (2.0 * around - 1.0)
    across = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    inside = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
    R = look_at_rotation(axis[None], np.zeros(1))[0]  # sums by row: their bits do not depend on B
    return np.stack([(inside * row).sum(axis=1) for row in R], axis=1)


def look_at_rotation(z: Array, roll: Array, y: Array | None = None) -> Array:
    """Return rotations (B, 3, 3) with third axes z (B, 3), turned about z by `roll` (B,) radians.

    Without roll, the second axis is as near as possible to y (3,), or to a coordinate axis if y is
    None.
    """
    reference = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = np.cross(reference if y is None else y, z)
    is_parallel = (x * x).sum(axis=1) < 1e-18  # z is along y, and every direction is equally near
    x[is_parallel] = np.cross(reference[is_parallel], z[is_parallel])
    x /= np.sqrt((x * x).sum(axis=1, keepdims=True))
    y, (c, s) = np.cross(z, x), (np.cos(roll)[:, None], np.sin(roll)[:, None])
    return np.stack([c * x + s * y, c * y - s * x, z], axis=2)
