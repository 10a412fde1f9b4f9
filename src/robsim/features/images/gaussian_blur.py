"""Gaussians of several widths, for the blur of pictures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.features.images.picture_plane import PicturePlane, Pixels
from robsim.kernels.image_features.blurred_pictures import blur_pictures
from robsim.kernels.image_features.blurred_rows import compute_blurred_rows
from robsim.kernels.image_features.picture_sums import LANES, compute_gram_matrix
from robsim.rendering.sensor_tables import build_blur_weights

LEAST_BLUR = 1e-3  # pixels: a Gaussian that changes no pixel


class Gaussians(NamedTuple):
    """Weights of Gaussians: deviations (n,), weights (n, m) and reaches (n,) in pixels."""

    deviations: Array
    weights: NDArray[np.float32]
    reach: NDArray[np.int64]

    def blur(self, images: Pixels, level: NDArray[np.int64]) -> Pixels:
        """Return images (B, h, w), each blurred by the Gaussian with the number level[b]."""
        out = np.empty_like(images)
        blur_pictures(images, level, self.weights, self.reach, out)
        return out


def build_gaussians(deviations: Array) -> Gaussians:
    """Return Gaussians of some standard deviations in pixels.

    >>> build_gaussians(np.array([0.5, 1.0])).reach
    array([2, 4])
    """
    finite = np.where(np.isfinite(deviations), deviations, LEAST_BLUR)  # NaN of runs that failed
    rows = [build_blur_weights(max(float(each), LEAST_BLUR)) for each in finite]
    weights = np.zeros((len(rows), max(map(len, rows))), dtype=np.float32)
    for row, to in zip(rows, weights, strict=True):
        to[: len(row)] = row
    reach = np.array([len(row) - 1 for row in rows], dtype=np.int64)
    return Gaussians(np.asarray(deviations, dtype=float), weights, reach)


class BlurredGoal(NamedTuple):
    """Pictures (n, h, w) at the goal with n Gaussians, their L (n, 6, N), and L'L (n, 6, 6)."""

    plane: PicturePlane
    images: Pixels
    rows: Pixels
    products: Array


def build_blurred_goal(
    image: Pixels, plane: PicturePlane, inverse_depth: Array, gaussians: Gaussians, terms: Array
) -> BlurredGoal:
    """Return a picture (h, w) at the goal with each Gaussian, and L of each.

    `terms` (n, 2) are the numbers S and T of `compute_blurred_rows` of each.
    """
    count = len(gaussians.deviations)
    repeated = np.repeat(image[None], count, axis=0)
    images = gaussians.blur(repeated, np.arange(count))
    rows = np.empty((count, 6, plane.padded_count), dtype=np.float32)
    wide = plane.size[1] - 2 * plane.border
    buffers = np.empty((2, wide), dtype=np.float32), np.empty((3, wide), dtype=np.float32)
    products, partial = np.empty((count, 6, 6)), np.empty(LANES, dtype=np.float32)
    for n, (picture, own) in enumerate(zip(images, rows, strict=True)):
        blur = float(terms[n, 0]), float(terms[n, 1])
        where = plane.border, plane.points, plane.slopes, inverse_depth
        compute_blurred_rows(picture, blur, *where, buffers, own)
        compute_gram_matrix(own, partial, products[n])
    return BlurredGoal(plane, images, rows, products)
