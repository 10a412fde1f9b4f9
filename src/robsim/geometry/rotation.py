"""Rotation matrices about an axis, and the check of rigid transforms."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError

ROTATION_TOLERANCE = 1e-6


def axis_rotation(axis: str, angle: float) -> Array:
    """Return the 3 x 3 rotation matrix about the x, y or z axis."""
    c, s, i = np.cos(angle), np.sin(angle), "xyz".index(axis)
    u, w = (i + 1) % 3, (i + 2) % 3
    R = np.eye(3)
    R[u, u], R[w, w], R[u, w], R[w, u] = c, c, 0.0 - s, s
    return R


def check_rigid(T: Array) -> None:
    """Raise InputError unless T (..., 4, 4) are rigid transforms."""
    R = T[..., :3, :3]
    off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0)
    if off > ROTATION_TOLERANCE:
        raise InputError(
            f"not a rotation: R'R differs from the identity by {off:.2g} "
            f"(allowed {ROTATION_TOLERANCE:g})"
        )
    if (np.linalg.det(R) < 0).any():
        raise InputError("not a rotation but a reflection: det R = -1")
    if np.abs(T[..., 3, :] - (0.0, 0.0, 0.0, 1.0)).max(initial=0.0) > 0:
        raise InputError("the last row of a pose must be 0 0 0 1")
