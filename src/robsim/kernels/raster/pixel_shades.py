"""Grey values at the centres of pixels, by runs of pixels of one face in a row."""

import numpy as np

from robsim.kernels.machine.jit import kernel
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.texel_levels import find_level, read_texels

BLOCK = 32  # pixels that are compared at once
SHORT = 16  # pixels of a run that is not divided
LEVEL_STEP = 0.5  # largest change of the level in a run


@kernel
def shade_pixels(faces, pictures, plane, placed, background, buffers, image):
    """Compute the grey value of the face at the centre of each pixel, or of the background."""
    height, width = image.shape
    for y in range(height):
        row, seen = image[y], buffers.face[y]
        start = 0
        while start < width:
            face = seen[start]
            end = _find_run_end(seen, start)
            if face != NO_FACE and faces.picture[face] >= 0:
                _shade_run(
                    faces.picture[face],
                    pictures,
                    plane,
                    placed.plane[face],
                    placed.shade[face],
                    y,
                    start,
                    end,
                    buffers,
                    row,
                )
            else:
                row[start:end] = background if face == NO_FACE else placed.shade[face]
            start = end


@kernel
def _find_run_end(seen, start):
    """Return the end of the pixels from `start` on that see one face."""
    face, end = seen[start], start + 1
    while end + BLOCK <= seen.size:  # many pixels in one comparison
        difference = 0
        for i in range(BLOCK):
            difference |= seen[end + i] ^ face
        if difference:
            break
        end += BLOCK
    while end < seen.size and seen[end] == face:
        end += 1
    return end


@kernel
def _shade_run(picture, pictures, plane, texel_plane, shade, y, start, end, buffers, row):
    """Compute the grey values of a run of pixels that see a picture.

    The level changes linearly within a part of the run, which is short where it changes fast.
    """
    here = find_pixel_level(plane, texel_plane, start, y)
    while start < end:
        stop = end
        there = find_pixel_level(plane, texel_plane, stop - 1, y)
        while abs(there - here) > LEVEL_STEP and stop - start > SHORT:
            stop = start + (stop - start) // 2
            there = find_pixel_level(plane, texel_plane, stop - 1, y)
        _find_texels(plane, texel_plane, y, start, stop, buffers)
        _mix_levels(pictures, picture, here, there, shade, stop - start, buffers, row[start:stop])
        start, here = stop, there


@kernel
def find_pixel_level(plane, texel_plane, x, y):
    """Return the level of a picture at the centre of a pixel."""
    if not plane.bends:
        return find_level(texel_plane, float(x), float(y), 0.0)
    at = min(x, plane.rays.shape[2] - 2)  # the width of a pixel here
    density = np.log2(abs(plane.rays[0, y, at + 1] - plane.rays[0, y, at]))
    return find_level(texel_plane, float(plane.rays[0, y, x]), float(plane.rays[1, y, x]), density)


@kernel
def _find_texels(plane, texel_plane, y, start, stop, buffers):
    """Compute the texel coordinates of the pixels from `start` to `stop` in a row."""
    u, v = buffers.u, buffers.v
    ux, uy, uc = _round_row(texel_plane[0])
    vx, vy, vc = _round_row(texel_plane[1])
    nx, ny, nc = _round_row(texel_plane[2])
    one = np.float32(1.0)
    if plane.bends:
        X, Y = plane.rays[0, y, start:stop], plane.rays[1, y, start:stop]
        for i in range(stop - start):
            depth = one / (nx * X[i] + ny * Y[i] + nc)
            u[i] = (ux * X[i] + uy * Y[i] + uc) * depth
            v[i] = (vx * X[i] + vy * Y[i] + vc) * depth
        return
    u0 = np.float32(texel_plane[0, 0] * start + texel_plane[0, 1] * y + texel_plane[0, 2])
    v0 = np.float32(texel_plane[1, 0] * start + texel_plane[1, 1] * y + texel_plane[1, 2])
    n0 = np.float32(texel_plane[2, 0] * start + texel_plane[2, 1] * y + texel_plane[2, 2])
    for i in range(stop - start):
        x = np.float32(i)
        depth = one / (n0 + nx * x)
        u[i], v[i] = (u0 + ux * x) * depth, (v0 + vx * x) * depth


@kernel
def _round_row(row):
    """Return three numbers in single precision."""
    return np.float32(row[0]), np.float32(row[1]), np.float32(row[2])


@kernel
def _mix_levels(pictures, picture, here, there, shade, n, buffers, out):
    """Compute n grey values between the two levels around the levels at both ends of a run."""
    top = pictures.count[picture] - 1
    lower = min(int(max(min(here, there), 0.0)), top)
    read_texels(pictures, picture, lower, n, buffers, out)
    if max(here, there) > lower and lower < top:
        other = buffers.grey
        read_texels(pictures, picture, lower + 1, n, buffers, other)
        first = np.float32(here - lower)
        step = np.float32((there - here) / max(n - 1, 1))
        for i in range(n):
            share = min(max(first + step * np.float32(i), np.float32(0.0)), np.float32(1.0))
            out[i] += share * (other[i] - out[i])
    if shade != 1.0:
        factor = np.float32(shade)
        for i in range(n):
            out[i] *= factor
