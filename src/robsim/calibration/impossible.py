"""What no view can be: marks outside the image, and joints far outside their limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.vision.camera import Camera
from robsim.world.scene import Scene

MARGIN = 3.0  # pixels by which detectors, and noise, may place a mark outside the image
SLACK = 0.1  # rad, m: encoders with an offset may tell a little more than the limits


def off_image(pixels: Array, camera: Camera) -> NDArray[np.bool_]:
    """Return which pixels (..., 2) are farther outside the image than a detector may place them.

    Those that are NaN are not, and none is of a camera whose image has no size.

    >>> off_image(np.array([[640.0, 2], [642, -2], [2, 640]]), Camera(np.eye(3), size=(640, 480)))
    array([False, False,  True])
    """
    if camera.size is None:
        return np.zeros(pixels.shape[:-1], dtype=bool)
    outside = (pixels < -MARGIN) | (pixels > np.add(camera.size, MARGIN))
    return np.asarray(outside.any(axis=-1))


def check_pixels(pixels: Array, camera: Camera) -> None:
    """Raise InputError for the first mark of pixels (V, N, 2) that is outside the image."""
    outside = np.argwhere(off_image(pixels, camera))
    if outside.size:
        view, mark = outside[0].tolist()
        (u, v), (width, height) = pixels[view, mark], camera.size or (0, 0)
        raise InputError(
            f"pixels: mark {mark} of view {view} is at ({u:.6g}, {v:.6g}), outside the image of "
            f"{width} x {height}: (column, row), or the camera of another image size?"
        )


def check_joints(q: Array, scene: Scene) -> None:
    """Raise InputError for the first of coordinates q (V, nq) that is far outside its limits."""
    low, high = scene.limits.T
    outside = np.argwhere((q < low - SLACK) | (q > high + SLACK))
    if outside.size:
        view, i = outside[0].tolist()
        unit = scene.coordinate_units[i]
        raise InputError(
            f"q: joint '{scene.coordinate_names[i]}' in view {view} is {q[view, i]:.6g} {unit}, "
            f"outside its limits [{low[i]:.6g}, {high[i]:.6g}] {unit}"
        )
