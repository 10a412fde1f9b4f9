"""Normal equations of the histograms of cells of pictures."""

import numpy as np

from robsim.kernels.image_features.grey_bins import BLACK, TAPS, WHITE, add_histograms, find_bins
from robsim.kernels.image_features.luminance_rows import CENTRAL, compute_luminance_rows
from robsim.kernels.image_features.picture_sums import LANES
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

LEAST_SHARE = 1e-3  # added to the shares, whose roots have no derivative at 0


@entry(
    "float32[:, ::1], (int64, float32[:, ::1], float32[:, ::1]), int64[::1], float64[::1], "
    "out float64[:, ::1], out float64[:, :, ::1]"
)
def measure_histograms(image, window, cells, inverse_depth, roots, L):
    """Compute the roots of histograms of a picture, and their interaction matrices.

    The root of a share p is sqrt(p + 0.001), with L = L_p / (2 sqrt(p + 0.001)).

    Parameters
    ----------
    image : array of float32, shape (h, w)
        Picture.
    window : tuple
        The border and the arrays of a `PicturePlane`.
    cells : array of int64, shape (N,)
        Cell of each pixel inside the border.
    inverse_depth : array of shape (3,)
        Coefficients of the inverse depth.
    roots, L : arrays of shape (cells, bins) and (cells, bins, 6)
        The results.
    """
    border, plane, slopes = window
    N, wide = cells.size, image.shape[1] - 2 * border
    gradient = np.empty((2, wide), dtype=np.float32)
    rows = np.empty((6, -(-N // LANES) * LANES), dtype=np.float32)
    first, weights, changes = np.empty(N, np.int64), np.empty((N, TAPS)), np.empty((N, TAPS))
    compute_luminance_rows(image, border, CENTRAL, plane, slopes, inverse_depth, gradient, rows)
    find_bins(image, border, BLACK, WHITE, roots.shape[1], first, weights, changes)
    add_histograms(first, weights, changes, cells, rows, roots, L)
    for cell in range(len(roots)):
        for j in range(roots.shape[1]):
            roots[cell, j] = np.sqrt(roots[cell, j] + LEAST_SHARE)
            for c in range(6):
                L[cell, j, c] /= 2.0 * roots[cell, j]


@entry(
    "float32[:, :, ::1], float64[:, ::1], float64[:, :, ::1], int64, (int64, float32[:, ::1], "
    "float32[:, ::1]), int64[::1], float64[:, ::1], out float64[:, :, ::1], out float64[:, ::1], "
    "out float64[::1]"
)
def compute_histogram_equations(
    images, goal, goal_rows, model, window, cells, inverse_depth, H, g, c
):
    """Compute the normal equations of the roots of histograms.

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Pictures.
    goal, goal_rows : arrays of shape (cells, bins) and (cells, bins, 6)
        Roots of the histograms at the goal, and their L.
    model : int
        0, 1 or 2: L of the goal, of now, or their mean.
    window, cells : tuple and array of int64, shape (N,)
        As in `measure_histograms`.
    inverse_depth : array of shape (B, 3)
        Coefficients of the inverse depth.
    H, g, c : arrays of shape (B, 6, 6), (B, 6) and (B,)
        The results: sums of L'L, L'e and e'e, over the number of cells.
    """
    roots, own = np.empty_like(goal), np.empty_like(goal_rows)
    for b in range(len(images)):
        measure_histograms(images[b], window, cells, inverse_depth[b], roots, own)
        H[b] = 0.0
        g[b] = 0.0
        c[b] = 0.0
        for cell in range(len(goal)):
            for j in range(goal.shape[1]):
                e = roots[cell, j] - goal[cell, j]
                L, then = own[cell, j], goal_rows[cell, j]
                for i in range(6):
                    L[i] = then[i] if model == 0 else L[i] if model == 1 else 0.5 * (L[i] + then[i])
                _add_row(L, e, 1.0 / len(goal), H[b], g[b])
                c[b] += e * e / len(goal)


@kernel
def _add_row(L, e, weight, H, g):
    """Add the row L (6,) of an error e to normal equations."""
    for i in range(6):
        g[i] += weight * L[i] * e
        for k in range(6):
            H[i, k] += weight * L[i] * L[k]
