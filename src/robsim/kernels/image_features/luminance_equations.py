"""Normal equations of the luminance of all pixels."""

import numpy as np

from robsim.kernels.image_features.luminance_rows import compute_luminance_rows
from robsim.kernels.image_features.picture_sums import (
    LANES,
    compute_gram_matrix,
    copy_rows,
    project_error,
    scale_rows,
    subtract_pictures,
    sum_products,
)
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

DESIRED, CURRENT, MEAN = 0, 1, 2  # the model of L
BINS = 1024  # of the histogram of differences, of a quarter of a grey value each
TUKEY = 4.6851  # tuning constant of the biweight, for 95 % efficiency with normal errors
TO_DEVIATION = 1.4826  # standard deviation over median of the magnitudes of normal numbers
LEAST_SHARE = 0.25  # of the contrast at the goal: smaller differences are those of a small motion


@entry(
    "float32[:, :, ::1], float32[:, ::1], float32[:, ::1], float64[:, ::1], int64, float64, "
    "(int64, float32[::1], float32[:, ::1], float32[:, ::1]), float64[:, ::1], "
    "out float64[:, :, ::1], out float64[:, ::1], out float64[::1]"
)
def compute_luminance_equations(
    images, goal, goal_rows, goal_products, model, contrast, window, inverse_depth, H, g, c
):
    """Compute the normal equations of the difference of pictures from their goal.

    With N pixels inside the border, the differences e and the rows L of the luminance,

        H = L'L / N,    g = L'e / N,    c = e'e / N.

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Pictures.
    goal : array of float32, shape (h, w)
        Picture at the goal.
    goal_rows : array of float32, shape (6, N rounded up to LANES)
        L of the goal.
    goal_products : array of shape (6, 6)
        L'L of the goal.
    model : int
        DESIRED, CURRENT or MEAN.
    contrast : float
        Contrast at the goal, for the weights of `weigh_differences` in H and g, with the sum of the
        weights instead of N; 0 for equal weights.
    window : tuple
        The border, the taps, and the arrays of a `PicturePlane`.
    inverse_depth : array of shape (B, 3)
        Coefficients of the inverse depth, see `compute_luminance_rows`.
    H, g, c : arrays of shape (B, 6, 6), (B, 6) and (B,)
        The results.
    """
    border, taps, plane, slopes = window
    height, width = goal.shape
    count = (height - 2 * border) * (width - 2 * border)
    size = goal_rows.shape[1]
    robust = contrast > 0.0
    partial, error = np.empty(LANES, dtype=np.float32), np.empty(size, dtype=np.float32)
    gradient = np.empty((2, width - 2 * border), dtype=np.float32)
    own = np.empty((6, size if model != DESIRED else 0), dtype=np.float32)
    weights = np.empty(size if robust else 0, dtype=np.float32)
    weighted = np.empty((6, size if robust else 0), dtype=np.float32)
    for b in range(len(images)):
        subtract_pictures(images[b], goal, border, error)
        rows = goal_rows
        if model != DESIRED:
            near = inverse_depth[b]
            compute_luminance_rows(images[b], border, taps, plane, slopes, near, gradient, own)
            if model == MEAN:
                _average_rows(goal_rows, own)
            rows = own
        total = float(count)
        c[b] = sum_products(error, error, partial) / total
        if robust:
            total = weigh_differences(error, count, contrast, weights)
            for i in range(size):
                weights[i] = np.sqrt(weights[i])
                error[i] *= weights[i]
            scale_rows(rows, weights, weighted)
            rows = weighted
        project_error(error, rows, partial, g[b])
        if model == DESIRED and not robust:
            copy_rows(goal_products, H[b])
        else:
            compute_gram_matrix(rows, partial, H[b])
        for i in range(6):
            g[b, i] /= total
            for j in range(6):
                H[b, i, j] /= total


@kernel
def _average_rows(others, rows):
    """Replace rows (6, N) by their means with others."""
    for k in range(6):
        one, other = rows[k], others[k]
        for i in range(one.size):
            one[i] = np.float32(0.5) * (one[i] + other[i])


@kernel
def weigh_differences(error, count, contrast, weights):
    """Compute the weights (N,) of Tukey's biweight of the first `count` differences.

    The weight of a difference e is (1 - (e / (4.685 sigma))^2)^2, and 0 beyond 4.685 sigma. The
    standard deviation sigma is estimated from the median of |e| in steps of a quarter of a grey
    value, and is at least a quarter of the contrast: most pixels of a plain background are equal.
    Return the sum of the weights.
    """
    bins = np.zeros(BINS, dtype=np.int64)
    for i in range(count):
        bins[min(int(4.0 * abs(error[i])), BINS - 1)] += 1
    below, middle = 0, 0
    while 2 * (below + bins[middle]) < count:
        below += bins[middle]
        middle += 1
    deviation = max(TO_DEVIATION * (middle + 0.5) / 4.0, LEAST_SHARE * contrast)
    scale, total = 1.0 / (TUKEY * deviation), 0.0
    for i in range(weights.size):
        share = (error[i] * scale) ** 2 if i < count else 1.0
        weights[i] = (1.0 - share) ** 2 if share < 1.0 else 0.0
        total += weights[i]
    return total
