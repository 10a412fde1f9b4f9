"""The intrinsics of the chapter's camera, in the axes of the chapter and of this package.

The chapter is "A Modeling and Simulation Platform for Robot Kinematics aiming Visual Servo
Control". Its camera has x up, y to the right and z along the optical axis, and its pixels (u, v)
are (row, column).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, as_positive
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose

# pose of the camera axes of this package in the camera axes of the chapter: the x axis of this
# package is the y axis of the chapter, and its y axis is the -x axis of the chapter
T_CHAPTER_CAMERA = Pose([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def intrinsics_from_chapter(Ki: ArrayLike) -> Array:
    """Return K for (column, row) from the chapter's Ki for (u, v) = (row, column).

    The first two rows of Ki are exchanged, and its columns are rotated to the axes of this package.
    """
    return as_floats(Ki, "Ki", (3, 3))[..., [1, 0, 2], :] @ T_CHAPTER_CAMERA.rotation


def chapter_intrinsics(f: float, px: float, py: float, alpha: float, u0: float, v0: float) -> Array:
    """Return Ki of the chapter's eq. (10), with (u, v, 1) = Ki (X/Z, Y/Z, 1).

    u = u0 - f X / (Z px cos alpha),    v = v0 + f (Y + X tan alpha) / (Z py)

    The lengths f, px and py have the same unit, and the skew angle alpha is in radians.

    >>> chapter_intrinsics(8e-3, 1e-5, 1e-5, 0.0, 240, 320)[0]
    array([-800.,    0.,  240.])
    """
    f, px, py = as_positive(f, "f"), as_positive(px, "px"), as_positive(py, "py")
    a, u0, v0 = as_floats([alpha, u0, v0], "alpha, u0, v0", (3,))
    if not abs(a) < np.pi / 2:
        raise InputError(f"alpha is the skew angle in radians, within +-pi/2, got {a}")
    return np.array([[-f / (px * np.cos(a)), 0, u0], [f * np.tan(a) / py, f / py, v0], [0, 0, 1]])
