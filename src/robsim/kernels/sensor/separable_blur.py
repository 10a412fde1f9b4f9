"""Blur of an image by the same symmetric weights along rows and columns."""

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part


@entry("out float32[:, ::1], float32[::1], out float32[::1], out float32[:, ::1]")
def blur_image(image, weights, padded, along_rows):
    """Blur an image (h, w) in place; pixels beyond the border have the value at the border.

    Parameters
    ----------
    image : array of float32, shape (h, w)
        Image, which the result replaces.
    weights : array of float32, shape (n + 1,)
        Weights at the distances 0 to n in pixels.
    padded : array of float32, shape (w + 2 n,)
        Buffer of a row.
    along_rows : array of float32, shape (h, w)
        Buffer of the image that is blurred along its rows.
    """
    height, width = image.shape
    reach = weights.size - 1
    for y in range(height):
        _pad_row(image[y], reach, padded)
        out, middle, centre = along_rows[y], padded[reach : reach + width], weights[0]
        for x in range(width):
            out[x] = centre * middle[x]
        for n in range(1, reach + 1):
            left, right = padded[reach - n : reach - n + width], padded[reach + n :]
            _add_pair(weights[n], left, right, width, out)
    for y in range(height):
        out, middle, centre = image[y], along_rows[y], weights[0]
        for x in range(width):
            out[x] = centre * middle[x]
        for n in range(1, reach + 1):
            above, below = along_rows[max(y - n, 0)], along_rows[min(y + n, height - 1)]
            _add_pair(weights[n], above, below, width, out)


@part
def _pad_row(row, reach, padded):
    """Copy a row with its first and last value repeated."""
    width = row.size
    for x in range(width):
        padded[reach + x] = row[x]
    for x in range(reach):
        padded[x] = row[0]
        padded[reach + width + x] = row[width - 1]


@part
def _add_pair(weight, one, other, width, out):
    """Add the weighted sums of two rows to a row."""
    for x in range(width):
        out[x] += weight * (one[x] + other[x])
