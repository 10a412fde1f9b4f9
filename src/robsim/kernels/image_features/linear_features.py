"""Features that are linear in the pixels of a picture, s = B I."""

import numpy as np

from robsim.kernels.image_features.luminance_rows import compute_luminance_rows
from robsim.kernels.image_features.picture_sums import LANES, sum_products
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel


@entry("float32[:, :, ::1], int64, float32[:, ::1], out float64[:, ::1]")
def project_pictures(images, border, basis, s):
    """Compute s[b, i], the sum of the pixels of a picture times basis[i].

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Pictures.
    border : int
        Pixels along the border that are not used.
    basis : array of float32, shape (k, N rounded up to LANES)
        Weights of the pixels inside the border, row by row; 0 beyond them.
    s : array of shape (B, k)
        Sums, the result.
    """
    partial = np.empty(LANES, dtype=np.float32)
    pixels = np.zeros(basis.shape[1], dtype=np.float32)
    for b in range(len(images)):
        _copy_inside(images[b], border, pixels)
        for i in range(len(basis)):
            s[b, i] = sum_products(basis[i], pixels, partial)


@kernel
def _copy_inside(image, border, pixels):
    """Copy the pixels inside a border, row by row."""
    height, width = image.shape
    wide = width - 2 * border
    for y in range(height - 2 * border):
        row, to = image[y + border, border:], pixels[y * wide :]
        for x in range(wide):
            to[x] = row[x]


@entry(
    "float32[:, :, ::1], float32[:, ::1], (int64, float32[::1], float32[:, ::1], "
    "float32[:, ::1]), float64[:, ::1], out float64[:, :, ::1]"
)
def project_luminance_rows(images, basis, window, inverse_depth, L):
    """Compute L[b, i], the sum over the pixels of basis[i] times the rows of the luminance.

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Pictures.
    basis : array of float32, shape (k, N rounded up to LANES)
        Weights of the pixels inside the border, as for `project_pictures`.
    window : tuple
        The border, the taps, and the arrays of a `PicturePlane`.
    inverse_depth : array of shape (B, 3)
        Coefficients of the inverse depth, see `compute_luminance_rows`.
    L : array of shape (B, k, 6)
        Interaction matrices, the result.
    """
    border, taps, plane, slopes = window
    partial = np.empty(LANES, dtype=np.float32)
    rows = np.empty((6, basis.shape[1]), dtype=np.float32)
    gradient = np.empty((2, images.shape[2] - 2 * border), dtype=np.float32)
    for b in range(len(images)):
        near = inverse_depth[b]
        compute_luminance_rows(images[b], border, taps, plane, slopes, near, gradient, rows)
        for i in range(len(basis)):
            for j in range(6):
                L[b, i, j] = sum_products(basis[i], rows[j], partial)
