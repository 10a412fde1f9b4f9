"""The pixels of the marks at a goal of numbers, if the numbers are image points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.base.value import replace_unchecked
from robsim.features.points import PixelPoints, Points
from robsim.servo.bound_block import BoundBlock
from robsim.servo.camera_target import CameraTarget
from robsim.vision.camera import Camera


def locate_goal_marks(sight: CameraTarget, parts: Sequence[BoundBlock], s: Array) -> Array:
    """Return the pixels (N, 2, runs) of the marks of a pair at the goal s (k,) of some blocks.

    They follow from blocks of `Points` and `PixelPoints` with all components; the pixels of other
    marks are NaN.
    """
    camera = sight.eye.camera
    points = np.full((len(sight.target.marks), 3, camera.rows.shape[1]), np.nan)
    points[:, 2] = 1.0  # the points lie in the plane at unit depth
    ends = np.cumsum([part.size for part in parts])
    for part, own in zip(parts, np.split(s, ends[:-1]), strict=True):
        if _holds_image_points(part, sight):
            marks = slice(None) if part.marks is None else part.marks
            is_pixel = isinstance(part.feature, PixelPoints)
            pairs = own.reshape(-1, 2, 1)
            points[marks, :2] = _remove_intrinsics(pairs, camera) if is_pixel else pairs
    plane = replace_unchecked(sight.target, marks=points)
    still = np.repeat(np.eye(3, 4)[..., None], points.shape[2], axis=2)
    return CameraTarget(sight.scene, sight.eye, plane).image(still, still)[1]


def _holds_image_points(part: BoundBlock, sight: CameraTarget) -> bool:
    """Return whether a block has the image points of marks of a pair, and nothing else."""
    known = type(part.feature) in (Points, PixelPoints) and part.components is None
    return known and part.sights[0].key == sight.key


def _remove_intrinsics(pixels: Array, camera: Camera) -> Array:
    """Return the normalised points (N, 2, runs) of undistorted pixels (N, 2, 1)."""
    K = camera.K.reshape(3, 3, -1)
    y = (pixels[:, 1] - K[1, 2]) / K[1, 1]
    x = (pixels[:, 0] - K[0, 2] - K[0, 1] * y) / K[0, 0]
    return np.stack([x, y], axis=1)
