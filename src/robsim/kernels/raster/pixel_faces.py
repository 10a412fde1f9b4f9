"""The face that is seen at the centre of each pixel, by a depth buffer."""

import math

import numpy as np

from robsim.kernels.machine.intrinsics import fragment, routine

NO_FACE = -1


@routine
def find_pixel_faces(faces, plane, placed, buffers):
    """Compute the nearest face at the centre of each pixel (NO_FACE without one), and 1/Z."""
    buffers.face[:] = NO_FACE
    buffers.nearness[:] = 0.0
    for f in range(faces.body.size):
        if placed.box[f, 0] > placed.box[f, 1]:
            continue
        sides = placed.sides[faces.first[f] : faces.first[f + 1]]
        _cover_pixels(plane.rays, sides, placed.plane[f, 2], placed.box[f], f, buffers)


@fragment
def _cover_pixels(rays, sides, near, box, f, buffers):
    """Enter a face into the pixels that it covers."""
    if rays is None:
        _cover_rows(sides, near, box, f, buffers)
    else:
        _cover_rays(sides, near, box, f, rays, buffers)


@fragment
def _cover_rows(sides, near, box, f, buffers):
    """Enter a face into the rows of an image without distortion."""
    face = np.int32(f)
    for y in range(box[2], box[3] + 1):
        low, high = float(box[0]), float(box[1])
        for i in range(sides.shape[0]):
            slope, value = sides[i, 0], sides[i, 1] * y + sides[i, 2]
            if slope > 0.0:
                low = max(low, -value)
            elif slope < 0.0:
                high = min(high, value)
            elif value < 0.0:
                high = low - 1.0
        if low > high:
            continue
        start, end = math.ceil(low), math.floor(high) + 1
        first = np.float32(near[0] * start + near[1] * y + near[2])
        step = np.float32(near[0])
        nearness, seen = buffers.nearness[y, start:end], buffers.face[y, start:end]
        for i in range(end - start):
            z = first + step * np.float32(i)
            is_nearer = z > nearness[i]
            seen[i] = face if is_nearer else seen[i]
            nearness[i] = z if is_nearer else nearness[i]


@fragment
def _cover_rays(sides, near, box, f, rays, buffers):
    """Enter a face into the pixels whose rays meet it."""
    face, inside, left, right = np.int32(f), buffers.inside, box[0], box[1] + 1
    a, b, c = np.float32(near[0]), np.float32(near[1]), np.float32(near[2])
    for y in range(box[2], box[3] + 1):
        X, Y, n = rays[0, y, left:right], rays[1, y, left:right], right - left
        for i in range(n):
            inside[i] = a * X[i] + b * Y[i] + c
        for k in range(sides.shape[0]):
            p, q, r = np.float32(sides[k, 0]), np.float32(sides[k, 1]), np.float32(sides[k, 2])
            for i in range(n):
                value = p * X[i] + q * Y[i] + r
                inside[i] = inside[i] if value >= np.float32(0.0) else np.float32(-1.0)
        nearness, seen = buffers.nearness[y, left:right], buffers.face[y, left:right]
        for i in range(n):
            is_nearer = inside[i] > nearness[i]
            seen[i] = face if is_nearer else seen[i]
            nearness[i] = inside[i] if is_nearer else nearness[i]
