"""Sums and means over the pixels of pictures, in an order that no machine changes.

A sum has LANES partial sums, each of every LANES-th pixel of a block, so that the machine adds
several pixels at a time and the bits are the same on every machine.
"""

import numpy as np

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel, part

LANES = 32
BLOCK = 4096  # pixels of a partial sum in single precision, a multiple of LANES


@part
def _add_lanes(partial):
    """Return the sum of the partial sums, in double precision."""
    total = 0.0
    for i in range(LANES):
        total += partial[i]
    return total


@kernel
def sum_products(one, other, partial):
    """Return the sum of one (N,) times other (N,), for N a multiple of LANES.

    Four products are added before they are added to a partial sum, which is faster by half.
    """
    total, most = 0.0, 4 * LANES
    for first in range(0, one.size, BLOCK):
        for i in range(LANES):
            partial[i] = 0.0
        end = min(first + BLOCK, one.size)
        whole = end - (end - first) % most
        for start in range(first, whole, most):
            _add_four_products(one[start : start + most], other[start : start + most], partial)
        for start in range(whole, end, LANES):
            a, b = one[start : start + LANES], other[start : start + LANES]
            for i in range(LANES):
                partial[i] += a[i] * b[i]
        total += _add_lanes(partial)
    return total


@part
def _add_four_products(a, b, partial):
    """Add the products of 4 LANES pixels to the partial sums (LANES,)."""
    a1, a2, a3 = a[LANES:], a[2 * LANES :], a[3 * LANES :]
    b1, b2, b3 = b[LANES:], b[2 * LANES :], b[3 * LANES :]
    for i in range(LANES):
        partial[i] += (a[i] * b[i] + a1[i] * b1[i]) + (a2[i] * b2[i] + a3[i] * b3[i])


@kernel
def project_error(error, rows, partial, out):
    """Compute the sums out (k,) of the rows (k, N) times an error (N,)."""
    for k in range(len(rows)):
        out[k] = sum_products(rows[k], error, partial)


@entry("float32[:, ::1], out float32[::1], out float64[:, ::1]")
def compute_gram_matrix(rows, partial, out):
    """Compute the matrix out (k, k) of the products of rows (k, N)."""
    for i in range(len(rows)):
        for j in range(i + 1):
            out[i, j] = out[j, i] = sum_products(rows[i], rows[j], partial)


@kernel
def scale_rows(rows, factors, out):
    """Compute the rows out (k, N) times factors (N,)."""
    for k in range(len(rows)):
        row, to = rows[k], out[k]
        for i in range(row.size):
            to[i] = row[i] * factors[i]


@part
def copy_rows(source, out):
    """Copy an array [n, m]. Numba would check its shape, and whether both overlap."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = source[i, j]


@kernel
def subtract_pictures(image, goal, border, out):
    """Compute the differences out (N,) of the pixels inside a border, row by row.

    The end of out beyond these pixels is 0.
    """
    height, width = image.shape
    wide = width - 2 * border
    for y in range(height - 2 * border):
        now, then, to = image[y + border, border:], goal[y + border, border:], out[y * wide :]
        for x in range(wide):
            to[x] = now[x] - then[x]
    for i in range((height - 2 * border) * wide, out.size):
        out[i] = 0.0


@entry("uint8[:, :, ::1], int64, out float64[::1]", "float32[:, :, ::1], int64, out float64[::1]")
def measure_contrasts(pictures, border, contrasts):
    """Compute the standard deviations contrasts (B,) of the pixels inside a border.

    The sums of whole numbers are exact, so that their order does not matter.
    """
    height, width = pictures.shape[1:]
    count = (height - 2 * border) * (width - 2 * border)
    for b in range(len(pictures)):
        total, square = 0, 0
        for y in range(border, height - border):
            row = pictures[b, y, border : width - border]
            for x in range(row.size):
                value = np.int32(row[x])
                total += value
                square += value * value
        contrasts[b] = np.sqrt(max(float(count * square - total * total), 0.0)) / count


@entry(
    "uint8[:, :, ::1], int64, out float32[:, :, ::1]",
    "float32[:, :, ::1], int64, out float32[:, :, ::1]",
)
def reduce_pictures(pictures, size, images):
    """Compute the means images (B, h, w) of blocks of size x size pixels of pictures.

    Parameters
    ----------
    pictures : array of uint8 or float32, shape (B, at least h size, at least w size)
        Grey values.
    size : int
        Width of a block in pixels; 1 copies the grey values.
    images : array of float32, shape (B, h, w)
        Means, the result.
    """
    for b in range(len(images)):
        for y in range(images.shape[1]):
            out = images[b, y]
            if size == 1:
                row = pictures[b, y]
                for x in range(out.size):
                    out[x] = row[x]
            else:
                _average_rows(pictures[b, y * size : (y + 1) * size], size, out)


@kernel
def _average_rows(rows, size, out):
    """Compute the means out (w,) of blocks of rows (size, at least w size)."""
    for x in range(out.size):
        total = 0
        for i in range(size):
            for j in range(size):
                total += rows[i, x * size + j]
        out[x] = total / (size * size)
