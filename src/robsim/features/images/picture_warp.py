"""Pictures of a plane after a motion of the camera, by interpolation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.vision.camera import Camera


def warp_pictures(pictures: NDArray[np.generic], camera: Camera, plane: Array, T: Array) -> Array:
    """Return the pictures after points X of a plane have moved to T X in camera axes.

    The point x of a plane n'X = 1, with the coefficients n = (a, b, c) of its inverse depth, moves
    by the homography R + t n'. Grey values are interpolated linearly; pixels whose origin is
    outside the picture get the value at its border.

    Parameters
    ----------
    pictures : ndarray of shape (B, h, w)
        Grey values.
    camera : Camera
        Camera with the size of the pictures.
    plane : ndarray of shape (3, B)
        Coefficients of the inverse depth, in 1/m.
    T : ndarray of shape (3, 4, B)
        Motion in camera axes.

    Returns
    -------
    ndarray of shape (B, h, w)
        Grey values as floats.

    Examples
    --------
    A translation by the width of a pixel:

    >>> camera = Camera([[10, 0, 1], [0, 10, 0], [0, 0, 1]], (3, 1))
    >>> T = np.eye(3, 4)[..., None].copy()
    >>> T[0, 3] = 0.1
    >>> warp_pictures(np.array([[[10, 20, 40]]]), camera, np.array([[0.0], [0.0], [1.0]]), T)
    array([[[10., 10., 20.]]])
    """
    count, height, width = pictures.shape
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    out = np.empty(pictures.shape)
    for b in range(count):
        own = camera.of_run(b)
        x = np.column_stack([own.normalise(pixels), np.ones(len(pixels))])
        back = np.linalg.inv(T[:, :3, b] + np.outer(T[:, 3, b], plane[:, b]))
        X = sum(x[:, j, None] * back[:, j] for j in range(3))  # no BLAS: the same bits anywhere
        before = own.image_of(np.ascontiguousarray(X)[..., None])[0][..., 0]
        out[b] = interpolate_picture(pictures[b], *before.T).reshape(height, width)
    return out


def interpolate_picture(picture: NDArray[Any], u: Array, v: Array) -> Array:
    """Return the values (n,) of a picture (h, w) at columns u and rows v, linear between centres.

    Places outside the picture have the value at its border, and NaN the value at its first pixel.
    """
    height, width = picture.shape
    u = np.nan_to_num(np.clip(u, 0.0, width - 1.0))
    v = np.nan_to_num(np.clip(v, 0.0, height - 1.0))
    left, top = u.astype(np.int64), v.astype(np.int64)
    right, below = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    across, down = u - left, v - top
    upper = picture[top, left] * (1.0 - across) + picture[top, right] * across
    lower = picture[below, left] * (1.0 - across) + picture[below, right] * across
    values: Array = upper * (1.0 - down) + lower * down
    return values
