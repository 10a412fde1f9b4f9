"""Grey values at the centres of pixels, by runs of pixels of one face in a row."""

import math

import numpy as np

from robsim.kernels.machine.intrinsics import fragment, routine
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.texel_levels import find_level, read_texels

BLOCK = 32  # pixels that are compared at once
SHORT = 16  # pixels of a run that is not divided
TONES = 16.0  # of a grey value
SMOOTH = 32  # tones between the faces of a curved surface, which have no edge
BACKGROUND_TONE, PICTURE_TONE = np.int32(-SMOOTH), 300 * TONES  # below and above grey values
LEVEL_STEP = 0.5  # largest change of the level in a run


@routine
def shade_pixels(faces, pictures, texels, plane, placed, background, buffers, image):
    """Compute the grey value of the face at the centre of each pixel, and its tone.

    The tone is a whole number: the grey value in sixteenths, or a number of its own for the
    background and for each picture.
    """
    seen = buffers.face
    for y in range(image.shape[0]):
        start = 0
        while start < image.shape[1]:
            face, end = np.int64(seen[y, start]), _find_run_end(seen, y, start)
            if texels is not None and face != NO_FACE and faces.picture[face] >= 0:
                picture = faces.picture[face]
                _shade_run(pictures, picture, plane, placed, face, y, start, end, buffers, image)
                tone = np.int32(PICTURE_TONE + SMOOTH * face)
            else:
                grey = background if face == NO_FACE else placed.shade[face]
                tone = BACKGROUND_TONE if face == NO_FACE else np.int32(TONES * grey)
                _fill(image[y, start:end], np.float32(grey))
            _fill(buffers.tone[y, start:end], tone)
            start = end


@fragment
def _fill(pixels, value):
    """Enter a value into all pixels."""
    for i in range(pixels.size):
        pixels[i] = value


@fragment
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


@fragment
def _shade_run(pictures, picture, plane, placed, face, y, start, end, buffers, image):
    """Compute the grey values of a run of pixels that see a picture.

    The level changes linearly within a part of the run, which is short where it changes fast.
    """
    here = _find_pixel_level(plane.rays, placed.plane, face, start, y)
    while start < end:
        stop, there = end, _find_pixel_level(plane.rays, placed.plane, face, end - 1, y)
        while abs(there - here) > LEVEL_STEP and stop - start > SHORT:
            stop = start + (stop - start) // 2
            there = _find_pixel_level(plane.rays, placed.plane, face, stop - 1, y)
        _find_texels(plane.rays, placed.plane, face, y, start, stop, buffers)
        shade = np.float32(placed.shade[face])
        _mix_levels(pictures, picture, here, there, shade, y, start, stop, buffers, image)
        start, here = stop, there


@routine
def _find_pixel_level(rays, planes, face, x, y):
    """Return the level of a picture at the centre of a pixel."""
    X, Y = _find_coordinates(rays, x, y)
    return find_level(planes, face, X, Y, find_density(rays, x, y))[2]


@routine
def _find_coordinates(rays, x, y):
    """Return the image coordinates of a pixel."""
    if rays is None:
        return float(x), float(y)
    return float(rays[0, y, x]), float(rays[1, y, x])


@routine
def find_density(rays, x, y):
    """Return the binary logarithm of the width of a pixel in image coordinates."""
    if rays is None:
        return 0.0
    at = min(x, rays.shape[2] - 2)
    return math.log2(abs(float(rays[0, y, at + 1]) - float(rays[0, y, at])))


@fragment
def _find_texels(rays, planes, face, y, start, stop, buffers):
    """Compute the texel coordinates of the pixels from `start` to `stop` in a row."""
    u, v, one, n = buffers.u, buffers.v, np.float32(1.0), stop - start
    if rays is None:
        ux, vx, nx, uy, vy, ny, u0, v0, n0 = _round_plane(planes[face], start, y)
        for i in range(n):
            x = np.float32(i)
            depth = one / (n0 + nx * x)
            u[i], v[i] = (u0 + ux * x) * depth, (v0 + vx * x) * depth
    else:
        ux, vx, nx, uy, vy, ny, u0, v0, n0 = _round_plane(planes[face], 0, 0)
        X, Y = rays[0, y, start:stop], rays[1, y, start:stop]
        for i in range(n):
            depth = one / (nx * X[i] + ny * Y[i] + n0)
            u[i] = (ux * X[i] + uy * Y[i] + u0) * depth
            v[i] = (vx * X[i] + vy * Y[i] + v0) * depth


@routine
def _round_plane(plane, x, y):
    """Return the numbers of a plane (3, 3) in single precision, for coordinates from (x, y) on."""
    f = np.float32
    u, v, n = plane[0], plane[1], plane[2]
    at_u, at_v = u[0] * x + u[1] * y + u[2], v[0] * x + v[1] * y + v[2]
    at_n = n[0] * x + n[1] * y + n[2]
    return f(u[0]), f(v[0]), f(n[0]), f(u[1]), f(v[1]), f(n[1]), f(at_u), f(at_v), f(at_n)


@fragment
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
