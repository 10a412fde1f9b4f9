"""Bins of grey values that are cubic B-splines, and their derivatives."""

import numpy as np

from robsim.kernels.machine.kernel import kernel

BLACK, WHITE = 0.0, 255.0
TAPS = 4  # bins that a grey value touches


@kernel
def find_bins(image, border, low, high, bins, first, weights, slopes):
    """Compute the weights of the pixels inside a border in bins of cubic B-splines.

    A grey value v is at t = 1 + (bins - 3) (v - low) / (high - low) on an axis whose bins are at
    the whole numbers from 0 to bins - 1, and has weights in the four bins around it, which sum to
    1. Values below `low` or above `high` are at these ends, with slopes of 0.

    Parameters
    ----------
    image : array of float32, shape (h, w)
        Grey values.
    border : int
        Pixels along the border that are not used.
    low, high : float
        Grey values at both ends of the bins.
    bins : int
        Number of bins, at least 4.
    first : array of int64, shape (N,)
        First of the four bins of each pixel, the result.
    weights, slopes : arrays of shape (N, 4)
        Weights in the bins, and their derivatives by the grey value, the results.
    """
    height, width = image.shape
    wide, scale = width - 2 * border, (bins - 3) / (high - low)
    for y in range(height - 2 * border):
        for x in range(wide):
            i = y * wide + x
            place = (image[y + border, x + border] - low) * scale
            t = min(max(place, 0.0), bins - 3.0)
            slope = scale if t == place else 0.0
            whole = min(int(t), bins - 4)
            f = t - whole
            first[i] = whole
            weights[i, 0] = (1.0 - f) ** 3 / 6.0
            weights[i, 1] = ((3.0 * f - 6.0) * f * f + 4.0) / 6.0
            weights[i, 2] = (((-3.0 * f + 3.0) * f + 3.0) * f + 1.0) / 6.0
            weights[i, 3] = f**3 / 6.0
            slopes[i, 0] = -0.5 * (1.0 - f) ** 2 * slope
            slopes[i, 1] = 0.5 * (3.0 * f - 4.0) * f * slope
            slopes[i, 2] = 0.5 * ((-3.0 * f + 2.0) * f + 1.0) * slope
            slopes[i, 3] = 0.5 * f * f * slope


@kernel
def add_histograms(first, weights, slopes, cells, rows, p, Lp):
    """Compute the histograms of cells of a picture, and their interaction matrices.

    Parameters
    ----------
    first, weights, slopes : arrays of shape (N,), (N, 4) and (N, 4)
        Bins of the pixels, see `find_bins`.
    cells : array of int64, shape (N,)
        Cell of each pixel.
    rows : array of float32, shape (6, at least N)
        L of the luminance.
    p, Lp : arrays of shape (cells, bins) and (cells, bins, 6)
        Shares of the pixels of a cell in the bins, and their L, the results.
    """
    count, six = np.zeros(len(p)), np.empty(6)
    p[:] = 0.0
    Lp[:] = 0.0
    for i in range(first.size):
        cell = cells[i]
        count[cell] += 1.0
        for c in range(6):
            six[c] = rows[c, i]
        for j in range(TAPS):
            to, slope = Lp[cell, first[i] + j], slopes[i, j]
            p[cell, first[i] + j] += weights[i, j]
            for c in range(6):
                to[c] += slope * six[c]
    for cell in range(len(p)):
        for j in range(p.shape[1]):
            p[cell, j] /= count[cell]
            for c in range(6):
                Lp[cell, j, c] /= count[cell]
