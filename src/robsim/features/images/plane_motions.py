"""Pictures of a plane after small motions of the camera, warped from one picture."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robsim.base.arrays import Array
from robsim.features.images.picture_plane import PicturePlane, Pixels
from robsim.features.images.picture_warp import interpolate_picture

PRIMES = 2, 3, 5, 7, 11, 13  # bases of the sequence of Halton of the six motions


def list_small_motions(count: int, angle: float, distance: float) -> Iterator[tuple[Array, Array]]:
    """Yield poses (R, t) of a moved camera in axes of the camera at the goal.

    Parameters
    ----------
    count : int
        Number of poses; the first is the goal itself.
    angle : float
        Largest rotation about each axis in radians.
    distance : float
        Largest translation along each axis in metres.

    Yields
    ------
    R, t : ndarrays of shape (3, 3) and (3,)
        The poses, by a sequence of Halton (1960, Numerische Mathematik 2).

    Examples
    --------
    >>> [t.tolist() for R, t in list_small_motions(2, 0.1, 0.3)]
    [[0.0, 0.0, 0.0], [0.0, -0.1, -0.18]]
    """
    yield np.eye(3), np.zeros(3)
    for index in range(1, count):
        share = np.array([2.0 * _invert_digits(index, base) - 1.0 for base in PRIMES])
        yield _rotate(angle * share[3:]), distance * share[:3]


def _invert_digits(index: int, base: int) -> float:
    """Return the number between 0 and 1 with the digits of an index in reverse order."""
    value, factor = 0.0, 1.0 / base
    while index:
        index, digit = divmod(index, base)
        value += digit * factor
        factor /= base
    return value


def _rotate(w: Array) -> Array:
    """Return the rotation (3, 3) by the angles w about x, then y, then z, number by number."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(w), np.sin(w)
    return np.array(
        [
            [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
            [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
            [-sy, sx * cy, cx * cy],
        ]
    )


def warp_picture(
    image: Pixels, plane: PicturePlane, inverse_depth: Array, R: Array, t: Array
) -> Pixels:
    """Return the pixels inside the border of a picture of a plane, seen by a moved camera.

    Parameters
    ----------
    image : ndarray of float32, shape (h, w)
        Picture of the camera at the goal.
    plane : PicturePlane
        Pixels of the pictures.
    inverse_depth : ndarray of shape (3,)
        Coefficients (a, b, c) of the inverse depth of the plane at the goal.
    R, t : ndarrays of shape (3, 3) and (3,)
        Pose of the moved camera in axes of the camera at the goal.

    Returns
    -------
    ndarray of float32, shape (N,)
        Grey values, interpolated linearly; points outside the picture have the value at its border.
    """
    x, y = plane.points.astype(float)
    n = [float(each) for each in inverse_depth]
    ray = [R[i, 0] * x + R[i, 1] * y + R[i, 2] for i in range(3)]
    share = (n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2]) / (
        1.0 - (n[0] * t[0] + n[1] * t[1] + n[2] * t[2])
    )
    X, Y, Z = (ray[i] + t[i] * share for i in range(3))
    Z = np.where(Z > 0.0, Z, np.nan)
    values = interpolate_picture(image, *_find_pixels(plane, X / Z, Y / Z))
    return values.astype(np.float32)


def _find_pixels(plane: PicturePlane, x: Array, y: Array) -> tuple[Array, Array]:
    """Return columns and rows of normalised points, with the slopes at each pixel.

    A lens is nearly linear over a small motion.
    """
    height, width = (side - 2 * plane.border for side in plane.size)
    ux, uy, vx, vy = plane.slopes.astype(float)
    dx, dy = x - plane.points[0], y - plane.points[1]
    row, column = np.divmod(np.arange(height * width), width)
    u = column + plane.border + ux * dx + uy * dy
    v = row + plane.border + vx * dx + vy * dy
    return u, v
