"""Pixels at the edges of faces, by the share of each face in the pixel."""

import math

import numpy as np

from robsim.kernels.machine.routine import part, routine
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.pixel_shades import find_density
from robsim.kernels.raster.texel_levels import find_level, sample_picture

SMOOTH = 2.0  # difference of grey values of a curved surface, between whose faces is no edge
BACKGROUND_TONE = -1024.0  # below the grey values
SAME_LINE = 1e-6  # of a pixel, the distance of two sides that are one


@routine
def smooth_edges(faces, pictures, plane, placed, background, pattern, buffers, image):
    """Compute the pixels anew that have another face in their neighbourhood.

    The value is the mean over the area of the pixel, if one line divides it between two faces or a
    face and the background. Otherwise, it is the mean over places `pattern` (2, n) in the pixel,
    each of the nearest face of the neighbourhood of 3 x 3 pixels. A picture is read once for each
    face and pixel.
    """
    height, width = image.shape
    face, differs, first, sides = buffers.face, buffers.differs, faces.first, placed.sides
    least, greatest, planes = buffers.least, buffers.greatest, placed.plane
    near, shares, hits = buffers.near, buffers.shares, buffers.hits
    for y in range(-1, height):
        below = min(y + 1, height - 1)
        _find_row_extremes(face[below], least[below % 3], greatest[below % 3])
        if y < 0 or not _compare_rows(least, greatest, max(y - 1, 0) % 3, y % 3, below % 3, differs):
            continue
        for x in range(width):
            if differs[x] == 0:
                continue
            count, has_background = _list_near_faces(face, placed.tone, x, y, near)
            if count == 0:
                continue
            axes = _find_pixel_axes(plane.rays, x, y)
            count, crossings = _drop_distant_faces(first, sides, axes, near, count)
            if count == 0 or (count == 1 and crossings == 0):
                continue  # the value at its centre is the value of the pixel
            if not _divide_pixel(sides, planes, axes, near, count, crossings, shares):
                _count_hits(first, sides, planes, pattern, axes, near, count, hits, shares)
            value, total = 0.0, 0.0
            for k in range(count):
                share, f = shares[k, 0], near[0, k]
                if share > 0.0:
                    right, down, grey = shares[k, 1] / share, shares[k, 2] / share, placed.shade[f]
                    if faces.picture[f] >= 0:
                        X = axes[0] + right * axes[2] + down * axes[4]
                        Y = axes[1] + right * axes[3] + down * axes[5]
                        density = find_density(plane.rays, x, y)
                        u, v, level = find_level(planes, f, X, Y, density)
                        grey *= sample_picture(pictures, faces.picture[f], u, v, level)
                    value, total = value + share * grey, total + share
            if has_background:
                value, total = value + (1.0 - total) * background, 1.0
            if total > 0.0:
                image[y, x] = value / total


@routine
def _find_row_extremes(face, least, greatest):
    """Compute the least and the greatest face of each pixel of a row and its two neighbours."""
    n = face.size
    for x in range(1, n - 1):
        least[x] = min(min(face[x - 1], face[x]), face[x + 1])  # noqa: PLW3301 - in one register
        greatest[x] = max(max(face[x - 1], face[x]), face[x + 1])  # noqa: PLW3301
    for x, other in ((0, min(1, n - 1)), (n - 1, max(n - 2, 0))):
        least[x], greatest[x] = min(face[x], face[other]), max(face[x], face[other])


@part
def _compare_rows(least, greatest, above, here, below, differs):
    """Compute which pixels of a row have several faces near them; return whether there are any."""
    any_differs = 0
    a, b, c = least[above], least[here], least[below]
    d, e, f = greatest[above], greatest[here], greatest[below]
    for x in range(differs.size):
        low = min(min(a[x], b[x]), c[x])  # noqa: PLW3301
        high = max(max(d[x], e[x]), f[x])  # noqa: PLW3301
        differs[x] = high - low
        any_differs |= high - low
    return any_differs != 0


@part
def _list_near_faces(face, tone, x, y, near):
    """Enter the faces near a pixel; return their number, and whether the background is near.

    The number is 0 if the faces have nearly the same grey value, and no picture.
    """
    count, has_background, low, high = 0, False, np.inf, -np.inf
    rows, columns = range(max(y - 1, 0), min(y + 2, face.shape[0])), range(max(x - 1, 0), min(x + 2, face.shape[1]))
    for j in rows:
        for i in columns:
            each = face[j, i]
            grey = BACKGROUND_TONE if each == NO_FACE else tone[each]
            low, high = min(low, grey), max(high, grey)
    if high - low < SMOOTH:
        return 0, False
    for j in rows:
        for i in columns:
            each, is_new = np.int64(face[j, i]), True
            for k in range(count):
                is_new &= near[0, k] != each
            if each == NO_FACE:
                has_background = True
            elif is_new:
                near[0, count] = each
                count += 1
    return count, has_background


@routine
def _find_pixel_axes(rays, x, y):
    """Return the image coordinates of a pixel, and their changes to the right and downwards."""
    if rays is None:
        return float(x), float(y), 1.0, 0.0, 0.0, 1.0
    left, right = max(x - 1, 0), min(x + 1, rays.shape[2] - 1)
    top, bottom = max(y - 1, 0), min(y + 1, rays.shape[1] - 1)
    across = _compare_rays(rays[:, y, left], rays[:, y, right], right - left)
    down = _compare_rays(rays[:, top, x], rays[:, bottom, x], bottom - top)
    return float(rays[0, y, x]), float(rays[1, y, x]), *across, *down


@routine
def _compare_rays(one, other, count):
    """Return the mean change of a ray (2,) in a pixel, of `count`."""
    return (float(other[0]) - float(one[0])) / count, (float(other[1]) - float(one[1])) / count


@routine
def _view_from_pixel(row, axes):
    """Return an affine function of the image at the centre of a pixel, and its two changes."""
    return (
        row[0] * axes[0] + row[1] * axes[1] + row[2],
        row[0] * axes[2] + row[1] * axes[3],
        row[0] * axes[4] + row[1] * axes[5],
    )


@part
def _drop_distant_faces(first, sides, axes, near, count):
    """Keep the faces that meet a pixel; return their number, and how many sides cross the pixel.

    `near` takes for each face the number of its sides that cross the pixel, and the last of them.
    """
    kept, crossings = 0, 0
    for k in range(count):
        f, crossed, is_beyond = near[0, k], 0, False
        for i in range(first[f], first[f + 1]):
            value, right, down = _view_from_pixel(sides[i], axes)
            reach = 0.5 * (abs(right) + abs(down))
            if value < reach:
                is_beyond |= value + reach < 0.0
                near[2, kept], crossed = i, crossed + 1
        if not is_beyond:
            near[0, kept], near[1, kept] = f, crossed
            kept, crossings = kept + 1, crossings + crossed
    return kept, crossings


@part
def _divide_pixel(sides, planes, axes, near, count, crossings, shares):
    """Compute the shares of one face or two faces that a line divides; return whether it does.

    `shares` takes the area of each face, and its first moments from the centre of the pixel.
    """
    if count > 2 or crossings == 0 or near[1, 0] > 1 or (count == 2 and near[1, 1] > 1):
        return False
    k = 0 if near[1, 0] == 1 else 1
    value, right, down = _view_from_pixel(sides[near[2, k]], axes)
    share, at_right, at_down = divide_square(value, right, down)
    shares[k, 0], shares[k, 1], shares[k, 2] = share, at_right, at_down
    if count == 1:
        return True
    other = 1 - k
    shares[other, 0], shares[other, 1], shares[other, 2] = 1.0 - share, -at_right, -at_down
    if crossings == 2:  # both have the same side, or the pixel is divided twice
        a, b, c = _view_from_pixel(sides[near[2, other]], axes)
        scale = max(abs(b), abs(c)) / max(abs(right), abs(down))
        gap = max(abs(a + scale * value), abs(b + scale * right), abs(c + scale * down))
        return gap <= SAME_LINE * max(abs(b), abs(c))
    value, right, down = _view_from_pixel(planes[near[0, k], 2] - planes[near[0, other], 2], axes)
    return value > 0.5 * (abs(right) + abs(down))  # the divided face is in front


@routine
def divide_square(value, right, down):
    """Return the area of the unit square where value + right x + down y >= 0, and its moments.

    The moments are the integrals of x and y. The line crosses the square, whose centre is 0.
    """
    p, q = abs(right), abs(down)
    high, low = max(p, q), min(p, q)
    if abs(value) <= 0.5 * (high - low):  # the line meets two opposite sides
        offset, slope = value / high, low / high
        area = 0.5 + offset
        along, across = 0.125 - 0.5 * offset * offset - slope * slope / 24.0, slope / 12.0
    else:  # the line cuts a corner
        rest = 0.5 * (p + q) - abs(value)
        corner = 0.5 * rest * rest / (high * low)
        area = corner if value < 0.0 else 1.0 - corner
        along = corner * (0.5 - rest / (3.0 * high))
        across = corner * (0.5 - rest / (3.0 * low))
    x, y = (along, across) if p >= q else (across, along)
    return area, math.copysign(x, right), math.copysign(y, down)


@part
def _count_hits(first, sides, planes, pattern, axes, near, count, hits, shares):
    """Compute the share of the places in a pixel that see each face, and their moments."""
    n, right, down = pattern.shape[1], pattern[0], pattern[1]
    nearest, seen, depth = hits[0], hits[1], hits[2]
    nearest[:], seen[:] = 0.0, -1.0
    for k in range(count):
        f = near[0, k]
        a, b, c = _view_from_pixel(planes[f, 2], axes)
        for s in range(n):
            depth[s] = a + b * right[s] + c * down[s]
        for i in range(first[f], first[f + 1]):
            a, b, c = _view_from_pixel(sides[i], axes)
            if a < 0.5 * (abs(b) + abs(c)):
                for s in range(n):
                    is_inside = a + b * right[s] + c * down[s] >= 0.0
                    depth[s] = depth[s] if is_inside else -1.0
        for s in range(n):
            is_nearer = depth[s] > nearest[s]
            seen[s] = k if is_nearer else seen[s]
            nearest[s] = depth[s] if is_nearer else nearest[s]
        shares[k, 0], shares[k, 1], shares[k, 2] = 0.0, 0.0, 0.0
    for s in range(n):
        k = int(seen[s])
        if k >= 0:
            shares[k, 0] += 1.0 / n
            shares[k, 1] += right[s] / n
            shares[k, 2] += down[s] / n
