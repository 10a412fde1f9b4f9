"""The image of a camera as the kernels of pictures take it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.formulas.perspective import NO_LENS
from robsim.kernels.raster.raster_arrays import ImagePlane
from robsim.rendering.recent_values import RecentValues
from robsim.vision.camera import Camera

MOST_KEPT_RAYS = 2_000_000  # of an image whose rays are kept: 16 MB
_PLANES: RecentValues[ImagePlane] = RecentValues(4)


def build_image_plane(camera: Camera, samples: int) -> ImagePlane:
    """Return the image plane of a camera whose pixels are divided into samples x samples."""
    assert camera.size is not None
    width, height = camera.size
    fine = camera.resized(width * samples, height * samples) if samples > 1 else camera
    if camera.lens_kind == NO_LENS:
        return ImagePlane(np.array(fine.K), np.linalg.inv(fine.K), None, None, None)
    if width * height * samples**2 > MOST_KEPT_RAYS:
        return _build_lens_plane(fine)
    return _PLANES.find((camera, samples), None, lambda: _build_lens_plane(fine))


def _build_lens_plane(camera: Camera) -> ImagePlane:
    """Return the image plane of a camera with distortion."""
    rays, unit = _compute_rays(camera), np.eye(3)
    return ImagePlane(unit, unit, rays, _find_line_ends(rays[1]), _find_line_ends(rays[0].T))


def crop_image_plane(plane: ImagePlane, top: int, end: int) -> ImagePlane:
    """Return the image plane of the rows from `top` to `end` of an image."""
    if plane.rays is not None:
        rays = np.ascontiguousarray(plane.rays[:, top:end])
        ends = _find_line_ends(rays[1]), _find_line_ends(rays[0].T)
        return plane._replace(rays=rays, row_ends=ends[0], column_ends=ends[1])
    down, up = np.eye(3), np.eye(3)
    down[1, 2], up[1, 2] = -top, top
    return plane._replace(matrix=down @ plane.matrix, inverse=plane.inverse @ up)


def _compute_rays(camera: Camera) -> NDArray[np.float32]:
    """Return the normalised coordinates (2, h, w) of all pixels, NaN beyond the valid radius."""
    assert camera.size is not None
    width, height = camera.size
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    rays = camera.normalise(grid.reshape(-1, 2)).reshape(height, width, 2)
    return np.ascontiguousarray(np.moveaxis(rays, -1, 0), dtype=np.float32)


def _find_line_ends(rays: NDArray[np.float32]) -> Array:
    """Return (2, n): the least ray from each line to the last, and the greatest up to each."""
    least = np.where(np.isnan(rays), np.inf, rays).min(axis=1)
    greatest = np.where(np.isnan(rays), -np.inf, rays).max(axis=1)
    from_here = np.minimum.accumulate(least[::-1])[::-1]
    return np.stack([from_here, np.maximum.accumulate(greatest)]).astype(float)
