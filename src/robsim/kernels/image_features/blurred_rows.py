"""The interaction matrix of the luminance of blurred pictures, and their normal equations."""

import numpy as np

from robsim.kernels.image_features.luminance_rows import CENTRAL, compute_luminance_rows
from robsim.kernels.image_features.picture_sums import (
    LANES,
    compute_gram_matrix,
    copy_rows,
    project_error,
    subtract_pictures,
    sum_products,
)
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

DESIRED, CURRENT, MEAN = 0, 1, 2  # the model of L


@entry(
    "float32[:, ::1], (float64, float64), int64, float32[:, ::1], float32[:, ::1], float64[::1], "
    "out (float32[:, ::1], float32[:, ::1]), out float32[:, ::1]"
)
def compute_blurred_rows(image, blur, border, plane, slopes, inverse_depth, buffers, rows):
    """Compute the rows (6, N) of L of a picture that a Gaussian has blurred.

    Blur and motion do not commute. With the velocity p of the pixels, which changes by the matrix
    dp/du within the Gaussian of variance S, the picture G changes with

        dG/dt = -grad G . p - S sum_ij dp_i/du_j d2G/du_i du_j + T (d2G/du2 + d2G/dv2) dZ/dt,

    to the first order of S in the width of the view. T is the standard deviation times its
    derivative by the depth.

    Parameters
    ----------
    image : array of float32, shape (h, w)
        Blurred grey values.
    blur : tuple of float
        S in square pixels, and T in square pixels per metre.
    border, plane, slopes, inverse_depth
        As in `compute_luminance_rows`.
    buffers : tuple
        Buffers of a row: the gradient (2, w - 2 border), and three second derivatives.
    rows : array of float32, shape (6, at least N)
        Rows of L, the result; its end beyond the pixels is 0.
    """
    gradient, second = buffers
    compute_luminance_rows(image, border, CENTRAL, plane, slopes, inverse_depth, gradient, rows)
    height, width = image.shape
    wide = width - 2 * border
    S, T = np.float32(blur[0]), np.float32(blur[1])
    near = inverse_depth.astype(np.float32)
    for y in range(border, height - border):
        _differentiate_twice(image, y, border, second)
        first = (y - border) * wide
        _add_blur_terms(second, plane[:, first:], near, S, T, rows[:, first : first + wide])


@kernel
def _differentiate_twice(image, y, border, second):
    """Compute the second derivatives (3, w) by uu, uv and vv of the pixels of a row."""
    uu, uv, vv = second[0], second[1], second[2]
    two, quarter = np.float32(2.0), np.float32(0.25)
    here, right, left = image[y, border:], image[y, border + 1 :], image[y, border - 1 :]
    above, above_right, above_left = (
        image[y - 1, border:],
        image[y - 1, border + 1 :],
        image[y - 1, border - 1 :],
    )
    below, below_right, below_left = (
        image[y + 1, border:],
        image[y + 1, border + 1 :],
        image[y + 1, border - 1 :],
    )
    for i in range(uu.size):
        uu[i] = right[i] + left[i] - two * here[i]
        vv[i] = above[i] + below[i] - two * here[i]
        uv[i] = quarter * ((below_right[i] + above_left[i]) - (below_left[i] + above_right[i]))


@kernel
def _add_blur_terms(second, plane, inverse_depth, S, T, rows):
    """Add the terms of S and T to the rows (6, w) of L of one row of a picture."""
    uu, uv, vv = second[0], second[1], second[2]
    xs, ys = plane[0], plane[1]
    r0, r1, r2, r3, r4 = rows[0], rows[1], rows[2], rows[3], rows[4]
    a, b, c = inverse_depth
    one, two = np.float32(1.0), np.float32(2.0)
    for i in range(uu.size):
        x, y = xs[i], ys[i]
        near = a * x + b * y + c
        p, q, r = S * uu[i], S * uv[i], S * vv[i]
        change = T * (uu[i] + vv[i])
        turn = change * (one / near)
        r0[i] += a * p + b * q
        r1[i] += a * q + b * r
        r2[i] -= (near + a * x) * p + (b * x + a * y) * q + (near + b * y) * r + change
        r3[i] -= y * p + x * q + two * y * r + y * turn
        r4[i] += two * x * p + y * q + x * r + x * turn


@entry(
    "float32[:, :, ::1], float32[:, :, ::1], float32[:, :, ::1], float64[:, :, ::1], int64[::1], "
    "int64, float64[:, ::1], (int64, float32[:, ::1], float32[:, ::1]), float64[:, ::1], "
    "out float64[:, :, ::1], out float64[:, ::1], out float64[::1]"
)
def compute_blurred_equations(
    images, goals, goal_rows, goal_products, level, model, blur, window, inverse_depth, H, g, c
):
    """Compute the normal equations of blurred pictures.

    Parameters
    ----------
    images : array of float32, shape (B, h, w)
        Blurred pictures.
    goals : array of float32, shape (levels, h, w)
        Picture at the goal with the blur of each level.
    goal_rows : array of float32, shape (levels, 6, N rounded up to LANES)
        L of the goal at each level.
    goal_products : array of shape (levels, 6, 6)
        L'L of the goal at each level.
    level : array of int64, shape (B,)
        Level of each picture.
    model : int
        DESIRED, CURRENT or MEAN.
    blur : array of shape (B, 2)
        S and T of each picture, see `compute_blurred_rows`.
    window : tuple
        The border and the arrays of a `PicturePlane`.
    inverse_depth : array of shape (B, 3)
        Coefficients of the inverse depth.
    H, g, c : arrays of shape (B, 6, 6), (B, 6) and (B,)
        The results: H = L'L / N, g = L'e / N, c = e'e / N.
    """
    border, plane, slopes = window
    height, width = images.shape[1:]
    wide = width - 2 * border
    count, size = (height - 2 * border) * wide, goal_rows.shape[2]
    partial, error = np.empty(LANES, dtype=np.float32), np.empty(size, dtype=np.float32)
    gradient, second = np.empty((2, wide), dtype=np.float32), np.empty((3, wide), dtype=np.float32)
    own = np.empty((6, size if model != DESIRED else 0), dtype=np.float32)
    for b in range(len(images)):
        subtract_pictures(images[b], goals[level[b]], border, error)
        rows = goal_rows[level[b]]
        if model != DESIRED:
            S, T = blur[b, 0], blur[b, 1]
            compute_blurred_rows(
                images[b], (S, T), border, plane, slopes, inverse_depth[b], (gradient, second), own
            )
            if model == MEAN:
                _average_rows(rows, own)
            rows = own
        c[b] = sum_products(error, error, partial) / count
        project_error(error, rows, partial, g[b])
        if model == DESIRED:
            copy_rows(goal_products[level[b]], H[b])
        else:
            compute_gram_matrix(rows, partial, H[b])
        for i in range(6):
            g[b, i] /= count
            for j in range(6):
                H[b, i, j] /= count


@kernel
def _average_rows(others, rows):
    """Replace rows (6, N) by their means with others."""
    for k in range(6):
        one, other = rows[k], others[k]
        for i in range(one.size):
            one[i] = np.float32(0.5) * (one[i] + other[i])
