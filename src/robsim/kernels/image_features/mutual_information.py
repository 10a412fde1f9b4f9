"""Mutual information of pictures with the picture at the goal, and its derivatives."""

import math

import numpy as np

from robsim.kernels.image_features.grey_bins import TAPS, find_bins
from robsim.kernels.image_features.luminance_rows import CENTRAL, compute_luminance_rows
from robsim.kernels.image_features.picture_sums import LANES, project_error
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

REACH = 2.5  # deviations from the mean to both ends of the bins
LEAST_DEVIATION = 0.1  # grey values


@entry(
    "float32[:, ::1], int64, int64, out int64[::1], out float64[:, ::1], out float64[:, ::1], "
    "out float64[::1] -> float64"
)
def find_standard_bins(image, border, bins, first, weights, slopes, standard):
    """Compute the bins of standard grey values, as `find_bins`, from -2.5 to 2.5 deviations.

    A standard value z is the difference of a grey value from the mean over the standard deviation
    inside the border, so that brightness and contrast do not matter. `standard` (N,) are these
    values, a result; return the standard deviation.
    """
    height, width = image.shape
    wide = width - 2 * border
    total, square = 0.0, 0.0
    for y in range(border, height - border):
        for x in range(border, width - border):
            total += image[y, x]
    mean = total / standard.size
    for y in range(height - 2 * border):
        for x in range(wide):
            difference = image[y + border, x + border] - mean
            standard[y * wide + x] = difference
            square += difference * difference
    deviation = max(math.sqrt(square / standard.size), LEAST_DEVIATION)
    for n in range(standard.size):
        standard[n] /= deviation
    low, high = mean - REACH * deviation, mean + REACH * deviation
    find_bins(image, border, low, high, bins, first, weights, slopes)
    return deviation


@kernel
def remove_mean_and_scale(factor, standard):
    """Remove the parts of the factors (N,) of pixels that only change mean and deviation.

    The factors f of a sum of f dz become factors of dI: f - mean(f) - z mean(f z), in place.
    """
    total, along = 0.0, 0.0
    for n in range(standard.size):
        total += factor[n]
        along += factor[n] * standard[n]
    total /= standard.size
    along /= standard.size
    for n in range(standard.size):
        factor[n] -= total + along * standard[n]


@entry("int64[::1], float64[:, ::1], int64[::1], float64[:, ::1], out float64[:, ::1]")
def fill_joint_histogram(first, weights, goal_first, goal_weights, p):
    """Compute the joint shares p (bins, bins) of grey values now and at the goal."""
    p[:] = 0.0
    for n in range(first.size):
        for i in range(TAPS):
            row, weight = p[first[n] + i], weights[n, i] / first.size
            for j in range(TAPS):
                row[goal_first[n] + j] += weight * goal_weights[n, j]


@entry("float64[:, ::1], out float64[:, ::1] -> float64")
def find_log_shares(p, logs):
    """Compute logs[i, j] = log(p_ij / (p_i p_j)), 0 where p_ij is 0; return sum p_ij logs[i, j]."""
    bins, information = len(p), 0.0
    now, then = np.zeros(bins), np.zeros(bins)
    for i in range(bins):
        for j in range(bins):
            now[i] += p[i, j]
            then[j] += p[i, j]
    for i in range(bins):
        for j in range(bins):
            logs[i, j] = math.log(p[i, j] / (now[i] * then[j])) if p[i, j] > 0.0 else 0.0
            information += p[i, j] * logs[i, j]
    return information


@kernel
def mix_logs(first, factors, goal_first, goal_factors, logs, out):
    """Compute out[n], the sum of factors[n, i] goal_factors[n, j] logs[i, j] over both bins."""
    for n in range(first.size):
        total = 0.0
        for i in range(TAPS):
            row = logs[first[n] + i]
            part = 0.0
            for j in range(TAPS):
                part += goal_factors[n, j] * row[goal_first[n] + j]
            total += factors[n, i] * part
        out[n] = total


@entry(
    "int64[::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[:, ::1], "
    "float64[:, ::1], out float32[:, ::1], out float64[:, ::1]"
)
def find_information_hessian(first, weights, slopes, standard, logs, p, rows, H):
    """Compute the matrix H (6, 6) of the second derivatives of the missing information at the goal.

    With the B-splines phi of the bins, and L of the luminance,

        H = 1/N sum over the pixels of E L'L + sum over the bins of A_ij' A_ji / p_ij,
        E = sum over i, j of phi_i' phi_j' log(p_ij / (p_i p_j)),
        A_ij = 1/N sum over the pixels of phi_i' phi_j L.

    The rows L (6, N) are replaced by those of grey values without changes of mean and deviation.
    """
    N, bins = first.size, len(p)
    factor = np.empty(N)
    for k in range(6):
        remove_mean_and_scale(rows[k], standard)
    mix_logs(first, slopes, first, slopes, logs, factor)
    A = np.zeros((bins, bins, 6))
    H[:] = 0.0
    for n in range(N):
        for a in range(6):
            for b in range(6):
                H[a, b] += factor[n] * rows[a, n] * rows[b, n] / N
        for i in range(TAPS):
            for j in range(TAPS):
                share = slopes[n, i] * weights[n, j] / N
                to = A[first[n] + i, first[n] + j]
                for a in range(6):
                    to[a] += share * rows[a, n]
    for i in range(bins):
        for j in range(bins):
            if p[i, j] > 0.0:
                for a in range(6):
                    for b in range(6):
                        H[a, b] += A[i, j, a] * A[j, i, b] / p[i, j]


@entry(
    "float32[:, :, ::1], (int64[::1], float64[:, ::1]), int64, float64, float64[:, ::1], (int64, "
    "float32[:, ::1], float32[:, ::1]), float64[:, ::1], out float64[:, :, ::1], "
    "out float64[:, ::1], out float64[::1]"
)
def compute_information_equations(
    images, goal, bins, most, hessian, window, inverse_depth, H, g, c
):
    """Compute normal equations of the missing information D = (MI(I, I) + MI*) / 2 - MI(I, I*).

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Pictures.
    goal : tuple of arrays
        First bins (N,) and weights (N, 4) of the pixels at the goal.
    bins : int
        Number of bins.
    most : float
        Information of the goal with itself.
    hessian : array of shape (6, 6)
        See `find_information_hessian`.
    window : tuple
        The border and the arrays of a `PicturePlane`.
    inverse_depth : array of shape (B, 3)
        Coefficients of the inverse depth.
    H, g, c : arrays of shape (B, 6, 6), (B, 6) and (B,)
        The results: the Hessian at the goal, the gradient, and 2 D in nats.
    """
    border, plane, slopes = window
    goal_first, goal_weights = goal
    N, wide = goal_first.size, images.shape[2] - 2 * border
    size = -(-N // LANES) * LANES
    gradient, partial = np.empty((2, wide), np.float32), np.empty(LANES, np.float32)
    rows, shared = np.empty((6, size), np.float32), np.empty(N, np.float32)
    factor, standard = np.zeros(size, np.float32), np.empty(N)
    first, weights, changes = np.empty(N, np.int64), np.empty((N, TAPS)), np.empty((N, TAPS))
    p, logs = np.empty((bins, bins)), np.empty((bins, bins))
    for b in range(len(images)):
        near = inverse_depth[b]
        compute_luminance_rows(images[b], border, CENTRAL, plane, slopes, near, gradient, rows)
        find_standard_bins(images[b], border, bins, first, weights, changes, standard)
        fill_joint_histogram(first, weights, first, weights, p)
        own = find_log_shares(p, logs)
        mix_logs(first, changes, first, weights, logs, factor)
        fill_joint_histogram(first, weights, goal_first, goal_weights, p)
        c[b] = max(most + own - 2.0 * find_log_shares(p, logs), 0.0)
        mix_logs(first, changes, goal_first, goal_weights, logs, shared)
        for n in range(N):
            factor[n] -= shared[n]
        remove_mean_and_scale(factor, standard)
        project_error(factor, rows, partial, g[b])
        for i in range(6):
            g[b, i] /= N
            for j in range(6):
                H[b, i, j] = hessian[i, j]
