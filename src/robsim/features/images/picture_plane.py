"""The normalised coordinates of the pixels of a picture."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import make_read_only
from robsim.base.errors import InputError
from robsim.kernels.image_features.luminance_rows import compute_luminance_rows
from robsim.kernels.image_features.picture_sums import LANES
from robsim.vision.camera import Camera

LEAST_BORDER = 3  # pixels: the reach of the derivatives
LEAST_SIDE = 4  # pixels inside the border

Pixels = NDArray[np.float32]


class PicturePlane(NamedTuple):
    """The pixels inside the border of a picture, row by row.

    Attributes
    ----------
    size : tuple of int
        Height and width of the picture.
    border : int
        Pixels along the border that are not used.
    points : ndarray of float32, shape (2, N)
        Normalised coordinates x, y.
    slopes : ndarray of float32, shape (4, N)
        Derivatives du/dx, du/dy, dv/dx, dv/dy of the column u and the row v.
    """

    size: tuple[int, int]
    border: int
    points: Pixels
    slopes: Pixels

    @property
    def pixel_count(self) -> int:
        """Number N of pixels inside the border."""
        return int(self.points.shape[1])

    @property
    def padded_count(self) -> int:
        """Number of pixels, rounded up to the lanes of sums."""
        return -(-self.pixel_count // LANES) * LANES


@lru_cache(16)
def build_picture_plane(camera: Camera, border: int, level: int = 0) -> PicturePlane:
    """Return the pixels of the pictures of a camera at a level.

    Parameters
    ----------
    camera : Camera
        Camera with a size.
    border : int
        Pixels along the border of the picture that are not used, at the finest level.
    level : int, default 0
        The picture has the means of blocks of 2^level x 2^level pixels.

    Returns
    -------
    PicturePlane
        The pixels inside the border, at least 3 pixels of that level wide.

    Raises
    ------
    InputError
        If the camera has no size, or the picture is too small.

    Examples
    --------
    >>> camera = Camera([[80, 0, 39.5], [0, 80, 29.5], [0, 0, 1]], (80, 60))
    >>> plane = build_picture_plane(camera, 10)
    >>> plane.pixel_count, plane.points[:, 0]
    (2400, array([-0.36875, -0.24375], dtype=float32))
    >>> plane.slopes[[0, 3], 0]
    array([80., 80.], dtype=float32)
    """
    if camera.size is None:
        raise InputError("a picture needs the size of its camera in pixels")
    block = 2**level
    width, height = (side // block for side in camera.size)
    inside = max(-(-border // block), LEAST_BORDER)
    if min(width, height) < 2 * inside + LEAST_SIDE:
        raise InputError(
            f"a picture of {width} x {height} pixels at level {level} has too few pixels inside "
            f"a border of {inside}: reduce border or level"
        )
    points = _normalise_pixels(camera, width, height, block)
    slopes = _compute_slopes(points)
    inner = slice(inside, height - inside), slice(inside, width - inside)
    flat = (part[:, *inner].reshape(len(part), -1).astype(np.float32) for part in (points, slopes))
    return PicturePlane((height, width), inside, *(make_read_only(part) for part in flat))


def compute_rows(
    image: Pixels, plane: PicturePlane, taps: Pixels, inverse_depth: NDArray[np.float64]
) -> Pixels:
    """Return L (6, N) of the luminance of a picture (h, w), padded with zeros for sums."""
    rows = np.empty((6, plane.padded_count), dtype=np.float32)
    buffer = np.empty((2, image.shape[1] - 2 * plane.border), dtype=np.float32)
    where = plane.points, plane.slopes, inverse_depth
    compute_luminance_rows(image, plane.border, taps, *where, buffer, rows)
    return rows


def _normalise_pixels(camera: Camera, width: int, height: int, block: int) -> NDArray[np.float64]:
    """Return the normalised coordinates (2, h, w) of the centres of blocks of pixels."""
    columns, rows = (block * (np.arange(side) + 0.5) - 0.5 for side in (width, height))
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    return np.moveaxis(camera.normalise(grid).reshape(height, width, 2), -1, 0)


def _compute_slopes(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivatives (4, h, w) of the pixels by the normalised points (2, h, w)."""
    xv, xu = np.gradient(points[0])
    yv, yu = np.gradient(points[1])
    determinant = xu * yv - xv * yu
    slopes: NDArray[np.float64] = np.stack([yv, -xv, -yu, xu]) / determinant
    return slopes
