"""The images of the centres of dots, from the centroids of the dots in a picture."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import IDENTITY
from robsim.vision.camera import Camera
from robsim.vision.plane import append_one, estimate_homography, map_points
from robsim.vision.tags.dot_pattern import DotPattern

FEWEST = 4  # dots of a homography
ROUNDS = 2  # the shifts of the second round differ by a share of (radius / distance)^2


def move_to_centers(dots: DotPattern, camera: Camera, centroids: Array) -> Array:
    """Return the images (N, 2) of the centres of dots from their centroids (N, 2), in pixels.

    The centroids yield the homography H of the plane of the dots, without the lens. The rims of
    the dots, mapped by H and the lens, have centroids that are shifted from the images of the
    centres; these shifts are subtracted. Without a lens the shift is the one of the centre of an
    ellipse, H Q H'(0, 0, 1) for the dual conic Q of a rim (Heikkila 2000). If fewer than four dots
    are found, or they lie on one line, the centroids are returned.
    """
    found = np.isfinite(centroids[:, 0])
    if found.sum() < FEWEST:
        return centroids
    centers, points = centroids.copy(), dots.points[found]
    for _ in range(ROUNDS):
        H = estimate_homography(points, camera.normalise(centers[found]))
        if not np.isfinite(H).all():
            return centroids
        shifts = find_rim_centroids(dots.discs[found], H, camera) - _project(points, H, camera)
        centers[found] = centroids[found] - np.nan_to_num(shifts)
    return centers


def find_rim_centroids(rims: Array, H: Array, camera: Camera) -> Array:
    """Return the centroids (N, 2) of polygons (N, M, 2) of a plane in the picture.

    H (3, 3) maps the plane to rays (x, y, 1) of the camera.

    >>> square = np.array([[[-1.0, -1], [1, -1], [1, 1], [-1, 1]]]) + 0.5
    >>> camera = Camera([[10, 0, 3], [0, 10, 4], [0, 0, 1]])
    >>> find_rim_centroids(square, np.eye(3), camera)
    array([[8., 9.]])
    """
    pixels = _project(rims.reshape(-1, 2), H, camera).reshape(rims.shape)
    middle = pixels.mean(axis=1, keepdims=True)
    here = pixels - middle
    after = np.roll(here, -1, axis=1)
    area = here[..., 0] * after[..., 1] - after[..., 0] * here[..., 1]  # twice, of triangles
    moment = ((here + after) * area[..., None]).sum(axis=1)
    return np.asarray(middle[:, 0] + moment / (3 * area.sum(axis=1))[:, None])


def _project(points: Array, H: Array, camera: Camera) -> Array:
    """Return the pixels (N, 2) of points (N, 2) of a plane."""
    return camera.project(append_one(map_points(H, points)), IDENTITY)
