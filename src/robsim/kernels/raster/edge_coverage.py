"""Pixels at the edges of faces, by the share of each face in the pixel."""

import numpy as np

from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.pixel_shades import find_density
from robsim.kernels.raster.texel_levels import find_level, find_texel, sample_picture

MOST = 9  # faces in the neighbourhood of a pixel
SMOOTH = 2.0  # difference of grey values of a curved surface, between whose faces is no edge


@part
def smooth_edges(faces, pictures, plane, placed, background, pattern, buffers, image):
    """Compute the pixels anew that have another face in their neighbourhood.

    `pattern` (n, 2) are places in a pixel. The value is the mean over these places, each of the
    nearest face of the neighbourhood of 3 x 3 pixels. A picture is read once for each pixel.
    """
    height, width = image.shape
    near, sums = np.empty(MOST, np.int64), np.empty((MOST, 3))
    for y in range(min(2, height)):
        _find_row_extremes(buffers.face[y], buffers.least[y], buffers.greatest[y])
    for y in range(height):
        below = min(y + 1, height - 1)
        least, greatest = buffers.least[below % 3], buffers.greatest[below % 3]
        _find_row_extremes(buffers.face[below], least, greatest)
        if not _compare_rows(buffers, max(y - 1, 0) % 3, y % 3, below % 3):
            continue
        for x in range(width):
            if buffers.differs[x] == 0:
                continue
            count, has_background = _list_near_faces(buffers.face, x, y, near)
            if not has_background and _is_smooth(faces, placed, near, count):
                continue
            axes = _find_pixel_axes(plane, x, y)
            count, is_whole = _drop_distant_faces(faces, placed, axes, near, count)
            if count == 0 or (count == 1 and is_whole):
                continue  # the value at its centre is the value of the pixel
            _count_hits(faces, placed, pattern, axes, near, count, sums)
            value, hits = _add_shares(faces, pictures, plane, placed, x, y, near, count, sums)
            if has_background:
                value, hits = value + (len(pattern) - hits) * background, len(pattern)
            if hits > 0:
                image[y, x] = value / hits


@kernel
def _find_row_extremes(face, least, greatest):
    """Compute the least and the greatest face of each pixel of a row and its two neighbours."""
    n = face.size
    for x in range(1, n - 1):
        least[x] = min(min(face[x - 1], face[x]), face[x + 1])  # noqa: PLW3301 - in one register
        greatest[x] = max(max(face[x - 1], face[x]), face[x + 1])  # noqa: PLW3301
    for x, other in ((0, min(1, n - 1)), (n - 1, max(n - 2, 0))):
        least[x], greatest[x] = min(face[x], face[other]), max(face[x], face[other])


@part
def _compare_rows(buffers, above, here, below):
    """Compute which pixels of a row have several faces near them; return whether there are any."""
    differs, any_differs = buffers.differs, 0
    a, b, c = buffers.least[above], buffers.least[here], buffers.least[below]
    d, e, f = buffers.greatest[above], buffers.greatest[here], buffers.greatest[below]
    for x in range(differs.size):
        low = min(min(a[x], b[x]), c[x])  # noqa: PLW3301
        high = max(max(d[x], e[x]), f[x])  # noqa: PLW3301
        differs[x] = high - low
        any_differs |= high - low
    return any_differs != 0


@part
def _list_near_faces(face, x, y, near):
    """Enter the faces near a pixel; return their number, and whether the background is near."""
    count, has_background = 0, False
    for j in range(max(y - 1, 0), min(y + 2, face.shape[0])):
        for i in range(max(x - 1, 0), min(x + 2, face.shape[1])):
            each, is_new = face[j, i], True
            for k in range(count):
                is_new &= near[k] != each
            if each == NO_FACE:
                has_background = True
            elif is_new:
                near[count] = each
                count += 1
    return count, has_background


@part
def _is_smooth(faces, placed, near, count):
    """Return whether faces without pictures have nearly the same grey value."""
    low, high, is_plain = np.inf, -np.inf, True
    for k in range(count):
        is_plain &= faces.picture[near[k]] < 0
        low, high = min(low, placed.shade[near[k]]), max(high, placed.shade[near[k]])
    return is_plain and high - low < SMOOTH


@part
def _find_pixel_axes(plane, x, y):
    """Return the image coordinates of a pixel, and their changes to the right and downwards."""
    if not plane.bends:
        return float(x), float(y), 1.0, 0.0, 0.0, 1.0
    rays = plane.rays
    left, right = max(x - 1, 0), min(x + 1, rays.shape[2] - 1)
    top, bottom = max(y - 1, 0), min(y + 1, rays.shape[1] - 1)
    return (
        float(rays[0, y, x]),
        float(rays[1, y, x]),
        (rays[0, y, right] - rays[0, y, left]) / (right - left),
        (rays[1, y, right] - rays[1, y, left]) / (right - left),
        (rays[0, bottom, x] - rays[0, top, x]) / (bottom - top),
        (rays[1, bottom, x] - rays[1, top, x]) / (bottom - top),
    )


@part
def _drop_distant_faces(faces, placed, axes, near, count):
    """Keep the faces that meet a pixel; return their number, and whether the last one fills it."""
    X, Y, right_x, right_y, down_x, down_y = axes
    kept, is_whole = 0, False
    for k in range(count):
        margin, spread = np.inf, np.inf  # the least ones inside all sides
        for i in range(faces.first[near[k]], faces.first[near[k] + 1]):
            a, b = placed.sides[i, 0], placed.sides[i, 1]
            value = a * X + b * Y + placed.sides[i, 2]
            reach = 0.5 * (abs(a * right_x + b * right_y) + abs(a * down_x + b * down_y))
            spread = min(spread, value + reach)
            margin = min(margin, value - reach)
        if spread >= 0.0:
            near[kept], is_whole = near[k], margin >= 0.0
            kept += 1
    return kept, is_whole


@part
def _count_hits(faces, placed, pattern, axes, near, count, sums):
    """Compute for each near face the number of places that see it, and the sum of these places."""
    X0, Y0, right_x, right_y, down_x, down_y = axes
    for k in range(count):
        sums[k, 0], sums[k, 1], sums[k, 2] = 0.0, 0.0, 0.0
    for s in range(len(pattern)):
        X = X0 + right_x * pattern[s, 0] + down_x * pattern[s, 1]
        Y = Y0 + right_y * pattern[s, 0] + down_y * pattern[s, 1]
        best, nearest = -1, 0.0
        for k in range(count):
            f = near[k]
            z = placed.plane[f, 2, 0] * X + placed.plane[f, 2, 1] * Y + placed.plane[f, 2, 2]
            if z > nearest and _contains(faces, placed, f, X, Y):
                best, nearest = k, z
        if best >= 0:
            sums[best, 0] += 1.0
            sums[best, 1] += X
            sums[best, 2] += Y


@part
def _contains(faces, placed, f, X, Y):
    """Return whether a face contains a point of the image."""
    for i in range(faces.first[f], faces.first[f + 1]):
        if placed.sides[i, 0] * X + placed.sides[i, 1] * Y + placed.sides[i, 2] < 0.0:
            return False
    return True


@part
def _add_shares(faces, pictures, plane, placed, x, y, near, count, sums):
    """Return the sum of grey values over the places that see a face, and their number."""
    value, hits = 0.0, 0.0
    for k in range(count):
        n, f = sums[k, 0], near[k]
        if n == 0.0:
            continue
        hits += n
        value += n * _find_grey(
            faces, pictures, plane, placed, f, x, y, sums[k, 1] / n, sums[k, 2] / n
        )
    return value, hits


@part
def _find_grey(faces, pictures, plane, placed, f, x, y, X, Y):
    """Return the grey value of a face at a point of the image in the pixel (x, y)."""
    picture, shade = faces.picture[f], float(placed.shade[f])
    if picture < 0:
        return shade
    u, v, _ = find_texel(placed.plane, f, X, Y)
    density = find_density(plane.rays, x, y) if plane.bends else 0.0
    level = find_level(placed.plane, f, X, Y, density)
    return shade * sample_picture(pictures, picture, u, v, level)
