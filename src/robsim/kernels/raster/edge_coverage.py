"""Pixels at the edges of faces, by the share of each face in the pixel."""

import math

import numpy as np

from robsim.kernels.machine.routine import part, routine
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.pixel_shades import find_density
from robsim.kernels.raster.texel_levels import find_level, sample_picture

PLACES = 16  # in a pixel that several lines divide
ALL_PLACES = (1 << PLACES) - 1
SMOOTH = 2.0  # difference of grey values of a curved surface, between whose faces is no edge
BACKGROUND_TONE = -1024.0  # below the grey values
SAME_LINE = 1e-6  # of a pixel, the distance of two sides that are one


@routine
def smooth_edges(faces, pictures, plane, placed, background, pattern, buffers, image):
    """Compute the pixels anew that have another face in their neighbourhood.

    The value is the mean over the area of the pixel, if one line divides it between two faces or a
    face and the background. Otherwise, it is the mean over places `pattern` (2, PLACES) in the pixel,
    each of the nearest face of the neighbourhood of 3 x 3 pixels. A picture is read once for each
    face and pixel.
    """
    height, width = image.shape
    face, differs, first, sides = buffers.face, buffers.differs, faces.first, placed.sides
    least, greatest, planes, rays = buffers.least, buffers.greatest, placed.plane, plane.rays
    near, shares = buffers.near, buffers.shares
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
            axes = _find_pixel_axes(rays, x, y)
            count, crossings = _drop_distant_faces(rays, first, sides, axes, near, count)
            if count == 0 or (count == 1 and crossings == 0):
                continue  # the value at its centre is the value of the pixel
            if not _divide_pixel(rays, sides, planes, axes, near, count, crossings, shares):
                _count_hits(rays, first, sides, planes, pattern, axes, near, count, shares)
            value, total = 0.0, 0.0
            for k in range(count):
                share, f = shares[k, 0], near[0, k]
                if share > 0.0:
                    right, down, grey = shares[k, 1] / share, shares[k, 2] / share, placed.shade[f]
                    if faces.picture[f] >= 0:
                        X = axes[0] + right * axes[2] + down * axes[4]
                        Y = axes[1] + right * axes[3] + down * axes[5]
                        density = find_density(rays, x, y)
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
    for j in range(max(y - 1, 0), min(y + 2, face.shape[0])):
        previous = NO_FACE - 1
        for i in range(max(x - 1, 0), min(x + 2, face.shape[1])):
            each = face[j, i]
            is_new = each != previous
            previous = each
            if each == NO_FACE:
                has_background, low = True, BACKGROUND_TONE
                continue
            for k in range(count):
                is_new &= near[0, k] != each
            if is_new:
                near[0, count], grey = each, tone[each]
                count, low, high = count + 1, min(low, grey), max(high, grey)
    return (0 if high - low < SMOOTH else count), has_background


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
def _view_from_pixel(rays, row, axes):
    """Return an affine function of the image at the centre of a pixel, and its two changes."""
    value = row[0] * axes[0] + row[1] * axes[1] + row[2]
    if rays is None:
        return value, row[0], row[1]
    return (
        value,
        row[0] * axes[2] + row[1] * axes[3],
        row[0] * axes[4] + row[1] * axes[5],
    )


@part
def _drop_distant_faces(rays, first, sides, axes, near, count):
    """Keep the faces that meet a pixel; return their number, and how many sides cross the pixel.

    `near` takes for each face the number of its sides that cross the pixel, and the last of them.
    """
    kept, crossings = 0, 0
    for k in range(count):
        f, crossed, reach = near[0, k], 0, 0.0
        for i in range(first[f], first[f + 1]):
            value, right, down = _view_from_pixel(rays, sides[i], axes)
            reach = value + 0.5 * (abs(right) + abs(down))
            if reach < 0.0:
                break
            if 2.0 * value < reach:
                near[2, kept], crossed = i, crossed + 1
        if reach >= 0.0:
            near[0, kept], near[1, kept] = f, crossed
            kept, crossings = kept + 1, crossings + crossed
    return kept, crossings


@part
def _divide_pixel(rays, sides, planes, axes, near, count, crossings, shares):
    """Compute the shares of one face or two faces that a line divides; return whether it does.

    `shares` takes the area of each face, and its first moments from the centre of the pixel.
    """
    if count > 2 or crossings == 0 or near[1, 0] > 1 or (count == 2 and near[1, 1] > 1):
        return False
    k = 0 if near[1, 0] == 1 else 1
    value, right, down = _view_from_pixel(rays, sides[near[2, k]], axes)
    share, at_right, at_down = divide_square(value, right, down)
    shares[k, 0], shares[k, 1], shares[k, 2] = share, at_right, at_down
    if count == 1:
        return True
    other = 1 - k
    shares[other, 0], shares[other, 1], shares[other, 2] = 1.0 - share, -at_right, -at_down
    if crossings == 2:  # both have the same side, or the pixel is divided twice
        a, b, c = _view_from_pixel(rays, sides[near[2, other]], axes)
        scale = max(abs(b), abs(c)) / max(abs(right), abs(down))
        gap = max(abs(a + scale * value), abs(b + scale * right), abs(c + scale * down))
        return gap <= SAME_LINE * max(abs(b), abs(c))
    value, right, down = _view_from_pixel(rays, planes[near[0, k], 2] - planes[near[0, other], 2], axes)
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
def _count_hits(rays, first, sides, planes, pattern, axes, near, count, shares):
    """Compute the share of the places in a pixel that see each face, and their moments.

    A set of places is a number with one bit for each.
    """
    masks = near[1]
    for k in range(count):
        f = near[0, k]
        masks[k] = _find_positive(_view_from_pixel(rays, planes[f, 2], axes), pattern)
        for i in range(first[f], first[f + 1]):
            masks[k] &= _find_positive(_view_from_pixel(rays, sides[i], axes), pattern)
        for j in range(k):  # of two faces, the nearer one keeps the places of both
            both = masks[j] & masks[k]
            if both != 0:
                gap = _view_from_pixel(rays, planes[near[0, j], 2] - planes[f, 2], axes)
                nearer = _find_positive(gap, pattern)
                masks[k] &= ~(both & nearer)
                masks[j] &= ~(both & ~nearer)
    for k in range(count):
        area, across, along, bits = 0, np.float32(0.0), np.float32(0.0), masks[k]
        for s in range(PLACES if bits != 0 else 0):
            hit = np.int32(bits >> s & 1)
            area += hit
            across += hit * pattern[0, s]
            along += hit * pattern[1, s]
        shares[k, 0] = area / PLACES
        shares[k, 1], shares[k, 2] = across / PLACES, along / PLACES


@routine
def _find_positive(view, pattern):
    """Return the places of a pixel where an affine function is not negative, as bits."""
    value, right, down = view
    if value >= 0.5 * (abs(right) + abs(down)):
        return ALL_PLACES
    value, right, down = np.float32(value), np.float32(right), np.float32(down)
    bits, across, along = np.int32(0), pattern[0], pattern[1]
    for s in range(PLACES):
        is_positive = value + right * across[s] + down * along[s] >= np.float32(0.0)
        bits |= np.int32(1 << s) if is_positive else np.int32(0)
    return np.int64(bits)
