"""Grey values at the centres of pixels, by runs of pixels of one face in a row."""

import math

import numpy as np

from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.texel_levels import find_level, read_texels

BLOCK = 32  # pixels that are compared at once
SHORT = 16  # pixels of a run that is not divided
LEVEL_STEP = 0.5  # largest change of the level in a run


@part
def shade_pixels(faces, pictures, plane, placed, background, buffers, image):
    """Compute the grey value of the face at the centre of each pixel, or of the background."""
    seen = buffers.face
    for y in range(image.shape[0]):
        start = 0
        while start < image.shape[1]:
            face, end = seen[y, start], _find_run_end(seen, y, start)
            if face != NO_FACE and faces.picture[face] >= 0:
                picture = faces.picture[face]
                _shade_run(pictures, picture, plane, placed, face, y, start, end, buffers, image)
            else:
                grey = np.float32(background if face == NO_FACE else placed.shade[face])
                for x in range(start, end):
                    image[y, x] = grey
            start = end


@part
def _find_run_end(seen, y, start):
    """Return the end of the pixels from `start` on in a row that see one face."""
    face, end, width = seen[y, start], start + 1, seen.shape[1]
    while end + BLOCK <= width:  # many pixels in one comparison
        difference, block = 0, seen[y, end : end + BLOCK]
        for i in range(BLOCK):
            difference |= block[i] ^ face
        if difference:
            break
        end += BLOCK
    while end < width and seen[y, end] == face:
        end += 1
    return end


@part
def _shade_run(pictures, picture, plane, placed, face, y, start, end, buffers, image):
    """Compute the grey values of a run of pixels that see a picture.

    The level changes linearly within a part of the run, which is short where it changes fast.
    """
    here = _find_pixel_level(plane, placed.plane, face, start, y)
    while start < end:
        stop = end
        there = _find_pixel_level(plane, placed.plane, face, stop - 1, y)
        while abs(there - here) > LEVEL_STEP and stop - start > SHORT:
            stop = start + (stop - start) // 2
            there = _find_pixel_level(plane, placed.plane, face, stop - 1, y)
        _find_texels(plane.bends, plane.rays, placed.plane, face, y, start, stop, buffers)
        shade = np.float32(placed.shade[face])
        _mix_levels(pictures, picture, here, there, shade, y, start, stop, buffers, image)
        start, here = stop, there


@kernel
def _find_pixel_level(plane, planes, face, x, y):
    """Return the level of a picture at the centre of a pixel."""
    if not plane.bends:
        return find_level(planes, face, float(x), float(y), 0.0)
    X, Y = float(plane.rays[0, y, x]), float(plane.rays[1, y, x])
    return find_level(planes, face, X, Y, find_density(plane.rays, x, y))


@kernel
def find_density(rays, x, y):
    """Return the binary logarithm of the width of a pixel in image coordinates."""
    at = min(x, rays.shape[2] - 2)
    return math.log2(abs(float(rays[0, y, at + 1]) - float(rays[0, y, at])))


@part
def _find_texels(bends, rays, planes, face, y, start, stop, buffers):
    """Compute the texel coordinates of the pixels from `start` to `stop` in a row."""
    u, v, one = buffers.u, buffers.v, np.float32(1.0)
    ux, uy, uc = _round_row(planes, face, 0)
    vx, vy, vc = _round_row(planes, face, 1)
    nx, ny, nc = _round_row(planes, face, 2)
    if bends:
        X, Y = rays[0, y, start:stop], rays[1, y, start:stop]
        for i in range(stop - start):
            depth = one / (nx * X[i] + ny * Y[i] + nc)
            u[i] = (ux * X[i] + uy * Y[i] + uc) * depth
            v[i] = (vx * X[i] + vy * Y[i] + vc) * depth
        return
    u0 = _find_row_value(planes, face, 0, start, y)
    v0 = _find_row_value(planes, face, 1, start, y)
    n0 = _find_row_value(planes, face, 2, start, y)
    for i in range(stop - start):
        x = np.float32(i)
        depth = one / (n0 + nx * x)
        u[i], v[i] = (u0 + ux * x) * depth, (v0 + vx * x) * depth


@part
def _find_row_value(planes, face, k, x, y):
    """Return a number of a face, such as 1/Z, at a pixel."""
    return np.float32(planes[face, k, 0] * x + planes[face, k, 1] * y + planes[face, k, 2])


@part
def _round_row(planes, face, k):
    """Return three numbers of a face in single precision."""
    row = planes[face, k, 0], planes[face, k, 1], planes[face, k, 2]
    return np.float32(row[0]), np.float32(row[1]), np.float32(row[2])


@part
def _mix_levels(pictures, picture, here, there, shade, y, start, stop, buffers, image):
    """Compute grey values between the two levels around the levels at both ends of a run."""
    top, n = pictures.count[picture] - 1, stop - start
    lower = min(int(max(min(here, there), 0.0)), top)
    fine, coarse, out = buffers.fine, buffers.coarse, image[y, start:stop]
    is_between = lower < top and max(here, there) > lower
    for k in range(2 if is_between else 1):
        read_texels(pictures, picture, lower + k, n, buffers, coarse if k else fine)
    if not is_between:
        for i in range(n):
            out[i] = shade * fine[i]
        return
    first, step = np.float32(here - lower), np.float32((there - here) / max(n - 1, 1))
    for i in range(n):
        share = min(max(first + step * np.float32(i), np.float32(0.0)), np.float32(1.0))
        out[i] = shade * (fine[i] + share * (coarse[i] - fine[i]))
