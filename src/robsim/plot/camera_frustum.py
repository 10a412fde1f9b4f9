"""The field of view of a camera: its corners, and the frustum of a camera without a body."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.vision.camera import Camera
from robsim.vision.plane import append_one

WIDEST = 3.0  # radius at unit depth (72 degrees) of the drawn rays of a fisheye
_BORDERLESS = ((-0.4, -0.3), (0.4, -0.3), (0.4, 0.3), (-0.4, 0.3))  # if the image size is unknown


def build_frustum_edges(camera: Camera, depth: float) -> tuple[Array, tuple[Array, ...]]:
    """Return the edges (8, 2, 3) and the four sides (3, 3) of the field of view up to a depth."""
    centre, rim = np.zeros(3), depth * compute_corner_rays(camera)
    sides = [(rim[i], rim[(i + 1) % 4]) for i in range(4)]
    edges = np.array([(centre, corner) for corner in rim] + sides)
    return edges, tuple(np.stack([centre, *side]) for side in sides)


def list_border_corners(camera: Camera) -> Array:
    """Return the corners (4, 2) of the image, clockwise from the upper left corner."""
    (left, right), (top, bottom) = camera.border
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])


def compute_corner_rays(camera: Camera) -> Array:
    """Return the points (4, 3) at unit depth on the rays through the image corners."""
    corners = np.array(_BORDERLESS)
    if camera.size is not None:
        corners = compute_drawn_points(camera, list_border_corners(camera))
    return append_one(corners)


def compute_drawn_points(camera: Camera, pixels: Array) -> Array:
    """Return the points (N, 2) at unit depth of pixels, within WIDEST of the axis for a fisheye.

    Pixels of a fisheye near or beyond 90 degrees have points far away or none.
    """
    points = camera.normalise(pixels)
    if camera.lens != "fisheye":
        return points
    K = np.atleast_3d(camera.K)[..., 0]
    direction = (pixels - K[:2, 2]) / K[[0, 1], [0, 1]]
    direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    far = ~(np.linalg.norm(points, axis=1) <= WIDEST)
    return np.where(far[:, None], WIDEST * direction, points)
