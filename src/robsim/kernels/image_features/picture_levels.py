"""Levels of a picture: means of blocks of pixels, as floats."""

from robsim.kernels.machine.jit import kernel


@kernel
def reduce_pictures(pictures, size, images):
    """Compute the means images (B, h, w) of blocks of size x size pixels of pictures.

    Parameters
    ----------
    pictures : array of uint8, shape (B, at least h size, at least w size)
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
