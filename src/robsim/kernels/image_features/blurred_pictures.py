"""Pictures blurred by Gaussians."""

import numpy as np

from robsim.kernels.image_features.picture_sums import copy_rows
from robsim.kernels.machine.entry import entry
from robsim.kernels.sensor.separable_blur import blur_image


@entry("float32[:, :, ::1], int64[::1], float32[:, ::1], int64[::1], out float32[:, :, ::1]")
def blur_pictures(images, level, weights, reach, out):
    """Compute pictures blurred by one of several Gaussians each.

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Pictures. Pixels beyond the border have the value at the border.
    level : array of int64, shape (B,)
        Gaussian of each picture.
    weights : array of float32, shape (levels, m)
        Weights of each Gaussian at the distances 0, 1, ... in pixels.
    reach : array of int64, shape (levels,)
        Largest distance of each Gaussian, below m.
    out : array of float32, shape (B, h, w)
        Blurred pictures, the result.
    """
    height, width = images.shape[1:]
    along_rows = np.empty((height, width), dtype=np.float32)
    padded = np.empty(width + 2 * weights.shape[1], dtype=np.float32)
    for b in range(len(images)):
        n, to = level[b], out[b]
        copy_rows(images[b], to)
        blur_image(to, weights[n, : reach[n] + 1], padded, along_rows)


@entry("float32[:, :, ::1], float32[:, ::1], int64, out float64[::1]")
def find_shares_of_contrast(images, goal, border, out):
    """Compute out[b], the rms of the difference from the goal over the contrast of the goal."""
    height, width = goal.shape
    count = (height - 2 * border) * (width - 2 * border)
    mean = 0.0
    for y in range(border, height - border):
        for x in range(border, width - border):
            mean += goal[y, x]
    mean /= count
    square = 0.0
    for y in range(border, height - border):
        for x in range(border, width - border):
            square += (goal[y, x] - mean) ** 2
    for b in range(len(images)):
        total = 0.0
        for y in range(border, height - border):
            for x in range(border, width - border):
                total += (images[b, y, x] - goal[y, x]) ** 2
        out[b] = np.sqrt(total / square) if square > 0.0 else 0.0
