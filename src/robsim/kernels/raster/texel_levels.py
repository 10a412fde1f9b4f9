"""Grey values of a picture at texel coordinates, from copies of falling size.

A texel coordinate is 0 at the left or upper edge of the picture, so the middle of its first pixel
is at 0.5. Level l has 2^-l of the size; between two levels the value is interpolated (Williams
1983, "Pyramidal parametrics").
"""

import math

import numpy as np

from robsim.kernels.machine.intrinsics import fragment, routine

SHARPER = 0.25  # of the squared size of a pixel in texels, the mean of both axes and half a level
LOW_HALF, SHIFT = np.uint32(0xFFFF), np.uint32(16)


@fragment
def _read_pair(texels, place):
    """Return a texel and, 65,536-fold, the next one, which processors read in one access."""
    return np.uint32(texels[place]) | np.uint32(texels[place + np.uint64(1)]) << SHIFT


@routine
def find_level(planes, face, X, Y, density):
    """Return the texel coordinates and the level of a face at image coordinates.

    `planes` (F, 3, 3) are the texel coordinates over Z and 1/Z of each face. The texels of the
    level are half a level smaller than a pixel, because the mixture of four texels blurs as well:
    this is nearest to the mean over the pixel (by 4 dB for pictures with the spectrum of natural
    images). `density` is the binary logarithm of image coordinates per pixel.
    """
    plane = planes[face]
    depth = 1.0 / (plane[2, 0] * X + plane[2, 1] * Y + plane[2, 2])
    u = (plane[0, 0] * X + plane[0, 1] * Y + plane[0, 2]) * depth
    v = (plane[1, 0] * X + plane[1, 1] * Y + plane[1, 2]) * depth
    square = 0.0
    for k in range(2):
        along_u, along_v = plane[0, k] - u * plane[2, k], plane[1, k] - v * plane[2, k]
        square += along_u * along_u + along_v * along_v
    return u, v, 0.5 * math.log2(np.float32(max(SHARPER * square * depth * depth, 1e-12))) + density


@routine
def sample_picture(pictures, picture, u, v, level):
    """Return the grey value of a picture at texel coordinates, between two levels."""
    level = min(max(level, 0.0), pictures.count[picture] - 1.0)
    lower, value = int(level), 0.0
    for k in range(lower, min(lower + 2, pictures.count[picture])):
        weight = 1.0 - abs(level - k)
        scale, numbers = 1.0 / (1 << k), pictures.level[picture, k]
        x = min(max(u * scale + 0.5, 0.5), numbers[2] + 0.5)
        y = min(max(v * scale + 0.5, 0.5), numbers[3] + 0.5)
        row, column = int(y), int(x)
        for below in range(2):
            place = numbers[0] + (row + below) * numbers[1] + column
            pair = _read_pair(pictures.texels, np.uint64(place))
            left, right = float(pair & LOW_HALF), float(pair >> SHIFT)
            share = y - row if below else 1.0 - (y - row)
            value += weight * share * (left + (x - column) * (right - left))
    return value / 256.0


@fragment
def read_texels(pictures, picture, level, n, buffers, out):
    """Compute the grey values out[:n] of one level at the texel coordinates of the buffers.

    The three loops are apart because processors compute coordinates and mixtures in registers of
    many numbers, but read texels one by one.
    """
    first, stride = np.int32(pictures.level[picture, level, 0]), pictures.level[picture, level, 1]
    half, scale = np.float32(0.5), np.float32(1.0 / (1 << level))
    most_x = np.float32(pictures.level[picture, level, 2]) + half
    most_y = np.float32(pictures.level[picture, level, 3]) + half
    u, v, x, y, index = buffers.u, buffers.v, buffers.x, buffers.y, buffers.index
    row_step = np.int32(stride)
    for i in range(n):
        p = min(max(u[i] * scale + half, half), most_x)
        q = min(max(v[i] * scale + half, half), most_y)
        column, row = np.int32(p), np.int32(q)
        x[i], y[i] = p - np.float32(column), q - np.float32(row)
        index[i] = first + row * row_step + column
    upper, lower, texels, below = buffers.upper, buffers.lower, pictures.texels, np.uint64(stride)
    for i in range(n):
        place = np.uint64(index[i])  # unsigned numbers cannot count from the end
        upper[i] = _read_pair(texels, place)
        lower[i] = _read_pair(texels, place + below)
    unit = np.float32(1.0 / 256.0)
    for i in range(n):
        left, right = np.float32(upper[i] & LOW_HALF), np.float32(upper[i] >> SHIFT)
        top = left + x[i] * (right - left)
        left, right = np.float32(lower[i] & LOW_HALF), np.float32(lower[i] >> SHIFT)
        bottom = left + x[i] * (right - left)
        out[i] = (top + y[i] * (bottom - top)) * unit
