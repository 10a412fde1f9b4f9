"""Rendered images of tags, boards and dots."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_integer
from robsim.base.errors import InputError, format_value
from robsim.geometry.pose import Pose, PoseLike, check_single_pose
from robsim.vision.camera import Camera
from robsim.vision.tags.board import Board
from robsim.vision.tags.dot_pattern import DotPattern
from robsim.vision.tags.tag import Tag

PrintedTarget = Tag | Board | DotPattern
INK, PAPER, BACKGROUND = 30.0, 225.0, 128.0  # grey values
MOST_PIXELS = 50_000_000
ROWS = 64  # image rows rendered at a time


def render_targets(
    camera: Camera, targets: Mapping[PrintedTarget, PoseLike], samples: int = 4
) -> NDArray[np.uint8]:
    """Return the grey image (h, w) of targets at poses in camera axes.

    A pixel is the mean grey value of `samples` x `samples` rays through the lens. Nearer targets
    hide farther targets. Light and paper are uniform, and the image has no blur beyond the area of
    the pixels. The function needs the extra `vision`.

    Parameters
    ----------
    camera : Camera
        Camera with a size.
    targets : mapping from Tag, Board or DotPattern to pose_like
        Poses T_c_o of the targets in camera axes.
    samples : int, default 4
        Rays along each side of a pixel.

    Returns
    -------
    ndarray of uint8, shape (h, w)
        Grey image: ink 30, paper 225, background 128.

    Raises
    ------
    InputError
        If the camera has no size, or a target or pose has another type.

    Examples
    --------
    >>> render_targets(Camera([[800, 0, 2], [0, 800, 1], [0, 0, 1]], size=(4, 2)), {})
    array([[128, 128, 128, 128],
           [128, 128, 128, 128]], dtype=uint8)
    """
    count = as_integer(samples, "samples", 1, 33)
    if not isinstance(camera, Camera) or camera.size is None:
        raise InputError(f"camera: expected a Camera with a size, got {format_value(camera)}")
    if not isinstance(targets, Mapping) or not all(isinstance(t, PrintedTarget) for t in targets):
        raise InputError(
            f"targets: expected poses by Tag, Board or DotPattern, got {format_value(targets)}"
        )
    width, height = camera.size
    if width * height > MOST_PIXELS:
        raise InputError(f"an image of {width} x {height} pixels is too large to render")
    posed = [
        (target, check_single_pose(T, f"pose of {target.name}")) for target, T in targets.items()
    ]
    image, within = np.empty((height, width)), spread_places(count)
    for top in range(0, height, ROWS):
        rows = np.arange(top, min(top + ROWS, height))
        grid = np.stack(np.meshgrid(np.arange(width), rows), axis=-1)
        image[rows] = _render_rows(camera, posed, grid[:, :, None] + within)
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


def _render_rows(camera: Camera, posed: list[tuple[PrintedTarget, Pose]], pixels: Array) -> Array:
    """Return the grey values (h, w) of pixels, each sampled at several positions (h, w, n, 2)."""
    rays = camera.normalise(pixels.reshape(-1, 2))
    grey, near = np.full(len(rays), BACKGROUND), np.full(len(rays), np.inf)
    for target, pose in posed:
        _paint_target(target, pose, rays, grey, near)
    return np.asarray(grey.reshape(pixels.shape[:3]).mean(axis=2))


def spread_places(count: int) -> Array:
    """Return places (count^2, 2) in a pixel, each in its own row and column.

    An edge along the rows is then resolved to 1/count^2 of a pixel instead of 1/count (the
    arrangement of Chiu, Shirley and Wang 1994).
    """
    i, j = (line.ravel() for line in np.meshgrid(np.arange(count), np.arange(count)))
    inner = np.stack([i + (j + 0.5) / count, j + (i + 0.5) / count], axis=-1) / count - 0.5
    return np.ascontiguousarray(inner)


def _paint_target(target: PrintedTarget, pose: Pose, rays: Array, grey: Array, near: Array) -> None:
    """Write the grey values of a target in place, for rays that meet its paper first."""
    R, t = pose.rotation, pose.position
    slope = rays @ R[:2, 2] + R[2, 2]  # component of a ray (x, y, 1) along the normal
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = R[:, 2] @ t / slope
        x, y = (depth * (rays @ R[:2, k] + R[2, k]) - R[:, k] @ t for k in (0, 1))
    (left, top), (right, bottom) = target.paper
    hit = (depth > 0) & (depth < near) & (x > left) & (x < right) & (y > top) & (y < bottom)
    near[hit] = depth[hit]
    grey[hit] = np.where(target.is_black(x[hit], y[hit]), INK, PAPER)
