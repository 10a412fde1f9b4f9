"""Directions, and rotations of a camera that looks along them."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array


def sample_cone_directions(axis: Array, cone: float, along: Array, around: Array) -> Array:
    """Return unit vectors (B, 3), uniform on the sphere within an angle of an axis (3,).

    cone           half angle in radians
    along, around  (B,) uniform numbers in (0, 1), which choose them
    """
    height = np.cos(cone) + (1.0 - np.cos(cone)) * along
    turn = np.pi * (2.0 * around - 1.0)
    across = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    inside = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    R = look_at_rotation(axis[None], np.zeros(1))[
        0
    ]  # row by row, as none depends on how many there are
    return np.stack([(inside * row).sum(axis=1) for row in R], axis=1)


def look_at_rotation(z: Array, roll: Array, y: Array | None = None) -> Array:
    """Return rotations (B, 3, 3) with third axes z (B, 3), turned about them by `roll` (B,).

    Without roll the second axes are as near as can be to y (3,); None: to some axis.
    """
    some = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = np.cross(some if y is None else y, z)
    along = (x * x).sum(axis=1) < 1e-18  # where z is along y any direction is as near as another
    x[along] = np.cross(some[along], z[along])
    x /= np.sqrt((x * x).sum(axis=1, keepdims=True))
    y, (c, s) = np.cross(z, x), (np.cos(roll)[:, None], np.sin(roll)[:, None])
    return np.stack([c * x + s * y, c * y - s * x, z], axis=2)
