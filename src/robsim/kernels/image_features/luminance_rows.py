"""The interaction matrix of the luminance of all pixels."""

import numpy as np

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel

# weights of the differences of pixels at the distances 1 to 3
CENTRAL = np.array([0.5, 0.0, 0.0], dtype=np.float32)
SEVEN_TAPS = np.array([2047.0 / 8418.0, 913.0 / 8418.0, 112.0 / 8418.0], dtype=np.float32)


@entry(
    "float32[:, ::1], int64, float32[::1], float32[:, ::1], float32[:, ::1], float64[::1], "
    "out float32[:, ::1], out float32[:, ::1]"
)
def compute_luminance_rows(image, border, taps, plane, slopes, inverse_depth, gradient, rows):
    """Compute the rows (6, N) of the interaction matrix of the luminance inside a border.

    With the derivatives p, q of the luminance by the normalised point (x, y),

        L = [p/Z, q/Z, -(p x + q y)/Z, -p x y - q (1 + y^2), p (1 + x^2) + q x y, q x - p y]

    the negative gradient times the interaction matrix of a point (Collewet and Marchand 2011, IEEE
    Trans. Robotics 27, 828).

    Parameters
    ----------
    image : array of float32, shape (h, w)
        Grey values.
    border : int
        Pixels along the border that are not used, at least 3.
    taps : array of float32, shape (3,)
        Weights of the differences of pixels at the distances 1, 2 and 3.
    plane : array of float32, shape (2, N)
        Normalised coordinates x, y of the pixels.
    slopes : array of float32, shape (4, N)
        Derivatives du/dx, du/dy, dv/dx, dv/dy of the column u and the row v.
    inverse_depth : array of shape (3,)
        Coefficients (a, b, c) of 1/Z = a x + b y + c.
    gradient : array of float32, shape (2, w - 2 border)
        Buffer of a row.
    rows : array of float32, shape (6, at least N)
        Rows of L, the result; its end beyond the pixels is 0.
    """
    height, width = image.shape
    wide = width - 2 * border
    a, b, c = inverse_depth.astype(np.float32)
    for y in range(border, height - border):
        _differentiate_row(image, y, border, taps, gradient)
        first = (y - border) * wide
        part = rows[:, first : first + wide]
        _fill_rows(gradient, plane[:, first:], slopes[:, first:], a, b, c, part)
    for k in range(6):
        for i in range((height - 2 * border) * wide, rows.shape[1]):
            rows[k, i] = 0.0


@kernel
def _differentiate_row(image, y, border, taps, gradient):
    """Compute the derivatives (2, w) of the pixels of a row by column and row."""
    along, down = gradient[0], gradient[1]
    row = image[y]
    for i in range(along.size):
        along[i] = down[i] = 0.0
    for n in range(1, 4):
        weight = taps[n - 1]
        if weight != 0.0:
            right, left = row[border + n :], row[border - n :]
            below, above = image[y + n, border:], image[y - n, border:]
            for i in range(along.size):
                along[i] += weight * (right[i] - left[i])
                down[i] += weight * (below[i] - above[i])


@kernel
def _fill_rows(gradient, plane, slopes, a, b, c, rows):
    """Compute the rows (6, w) of L of the pixels of one row of a picture."""
    along, down = gradient[0], gradient[1]
    xs, ys = plane[0], plane[1]
    ux, uy, vx, vy = slopes[0], slopes[1], slopes[2], slopes[3]
    r0, r1, r2, r3, r4, r5 = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    one = np.float32(1.0)
    for i in range(along.size):
        x, y = xs[i], ys[i]
        p, q = ux[i] * along[i] + vx[i] * down[i], uy[i] * along[i] + vy[i] * down[i]
        near = a * x + b * y + c
        r0[i] = p * near
        r1[i] = q * near
        r2[i] = -(p * x + q * y) * near
        r3[i] = -p * x * y - q * (one + y * y)
        r4[i] = p * (one + x * x) + q * x * y
        r5[i] = q * x - p * y
