"""Pixels at the edges of faces, by the share of each face in the pixel."""

import math

import numpy as np

from robsim.kernels.machine.intrinsics import fragment, routine
from robsim.kernels.raster.pixel_faces import NO_FACE
from robsim.kernels.raster.pixel_shades import BLOCK, SMOOTH, find_density
from robsim.kernels.raster.texel_levels import find_level, sample_picture

PLACES = 16  # in a pixel with several faces
ALL_PLACES = (1 << PLACES) - 1
SAME_LINE = 1e-6  # of a pixel, the distance of two sides that are one
MOST_CROSSINGS = 64  # sides of a face, or their continuations, that divide a pixel exactly


@routine
def smooth_edges(faces, pictures, texels, plane, placed, background, pattern, buffers, image):
    """Compute the pixels anew that have another tone in their neighbourhood.

    The value is the mean over the area of the pixel, if one face covers a part of it, before one
    other face or the background. Otherwise, it is the mean over places `pattern` (2, PLACES) in the
    pixel, each of the nearest face of the neighbourhood of 3 x 3 pixels. A picture is read once for
    each face and pixel.
    """
    height, width = image.shape
    face, tone, first, sides = buffers.face, buffers.tone, faces.first, placed.sides
    least, greatest, planes, rays = buffers.least, buffers.greatest, placed.plane, plane.rays
    differs, near, shares = buffers.differs, buffers.near, buffers.shares
    for y in range(-1, height):
        below = min(y + 1, height - 1)
        _find_row_extremes(tone[below], least[below % 3], greatest[below % 3])
        if y < 0 or not _compare_rows(least, greatest, differs, max(y - 1, 0), y, below):
            continue
        x = -1
        while True:
            x = _find_edge(differs, x + 1)
            if x == width:
                break
            count, has_background = _list_near_faces(face, x, y, near)
            axes = _find_pixel_axes(rays, x, y)
            count, crossings = _drop_distant_faces(rays, first, sides, axes, near, count)
            if count == 0 or (count == 1 and crossings == 0):
                continue  # the value at its centre is the value of the pixel
            if not _divide_pixel(
                *(rays, first, sides, planes, axes, near, count, crossings, buffers.polygon, shares)
            ):
                _count_hits(rays, first, sides, planes, pattern, axes, near, count, shares)
            value, total = 0.0, 0.0
            for k in range(count):
                share, f = shares[k, 0], near[0, k]
                if share > 0.0:
                    right, down, grey = shares[k, 1] / share, shares[k, 2] / share, placed.shade[f]
                    if texels is not None and faces.picture[f] >= 0:
                        X = axes[0] + right * axes[2] + down * axes[4]
                        Y = axes[1] + right * axes[3] + down * axes[5]
                        u, v, level = find_level(planes, f, X, Y, find_density(rays, x, y))
                        grey *= sample_picture(pictures, faces.picture[f], u, v, level)
                    value, total = value + share * grey, total + share
            if has_background:
                value, total = value + (1.0 - total) * background, 1.0
            if total > 0.0:
                image[y, x] = value / total


@routine
def _find_row_extremes(tone, least, greatest):
    """Compute the least and the greatest tone of each pixel of a row and its two neighbours."""
    n = tone.size
    for x in range(1, n - 1):
        least[x] = min(min(tone[x - 1], tone[x]), tone[x + 1])  # noqa: PLW3301 - in one register
        greatest[x] = max(max(tone[x - 1], tone[x]), tone[x + 1])  # noqa: PLW3301
    for x, other in ((0, min(1, n - 1)), (n - 1, max(n - 2, 0))):
        least[x], greatest[x] = min(tone[x], tone[other]), max(tone[x], tone[other])


@fragment
def _compare_rows(least, greatest, differs, above, here, below):
    """Compute which pixels of a row have several tones near them; return whether there are any."""
    any_differs = 0
    a, b, c = least[above % 3], least[here % 3], least[below % 3]
    d, e, f = greatest[above % 3], greatest[here % 3], greatest[below % 3]
    for x in range(differs.size):
        low = min(min(a[x], b[x]), c[x])  # noqa: PLW3301
        high = max(max(d[x], e[x]), f[x])  # noqa: PLW3301
        differs[x] = (high - low) & ~(SMOOTH - 1)
        any_differs |= differs[x]
    return any_differs != 0


@fragment
def _find_edge(differs, x):
    """Return the first pixel of a row, from x on, with several tones near it; or the row's end."""
    width = differs.size
    while x < width and differs[x] == 0:
        step = 1
        if x % BLOCK == 0 and x + BLOCK <= width:  # many pixels in one comparison
            difference, block = 0, differs[x : x + BLOCK]
            for i in range(BLOCK):
                difference |= block[i]
            step = BLOCK if difference == 0 else 1
        x += step
    return x


@fragment
def _list_near_faces(face, x, y, near):
    """Enter the faces near a pixel; return their number, and whether the background is near."""
    left, right = max(x - 1, 0), min(x + 1, face.shape[1] - 1)
    upper, row, lower = face[max(y - 1, 0)], face[y], face[min(y + 1, face.shape[0] - 1)]
    a, b, c, d, e = upper[left], upper[x], upper[right], row[left], row[x]
    f, g, h, i = row[right], lower[left], lower[x], lower[right]
    least, most = min(a, b, c, d, e, f, g, h, i), max(a, b, c, d, e, f, g, h, i)
    has_background, count = least == NO_FACE, 1
    near[0, 0], near[0, 1] = most, least
    if not has_background and least != most:
        count = 2
    others = 0  # without branches: most pixels are near two faces, or one and the background
    for each in (a, b, c, d, e, f, g, h, i):
        others |= (each - least) * (each - most)
    if others != 0:
        for each in (a, b, c, d, e, f, g, h, i):
            is_new = each != NO_FACE
            for k in range(count):
                is_new &= near[0, k] != each
            if is_new:
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


@fragment
def _view_from_pixel(rays, row, axes):
    """Return an affine function of the image at the centre of a pixel, and its two changes."""
    value = row[0] * axes[0] + row[1] * axes[1] + row[2]
    if rays is None:
        return value, row[0], row[1]
    return (value, row[0] * axes[2] + row[1] * axes[3], row[0] * axes[4] + row[1] * axes[5])


@fragment
def _compare_depths(rays, planes, one, other, axes):
    """Return how much nearer a face is than another one, at a pixel, and the two changes."""
    a, b, c = _view_from_pixel(rays, planes[one, 2], axes)
    d, e, f = _view_from_pixel(rays, planes[other, 2], axes)
    return a - d, b - e, c - f


@fragment
def _drop_distant_faces(rays, first, sides, axes, near, count):
    """Keep the faces that meet a pixel; return their number, and how many sides cross the pixel.

    `near` takes for each face the number of its sides that cross the pixel, and the last of them.
    """
    kept, crossings = 0, 0
    for k in range(count):
        f, crossed, reach = near[0, k], 0, 0.0
        for i in range(first[f], first[f + 1]):
            value, right, down = _view_from_pixel(rays, sides[i], axes)
            half = 0.5 * (abs(right) + abs(down))
            reach = value + half
            if reach < 0.0:
                break
            if value < half:
                near[2, kept], crossed = i, crossed + 1
        if reach >= 0.0:
            near[0, kept], near[1, kept] = f, crossed
            kept, crossings = kept + 1, crossings + crossed
    return kept, crossings


@fragment
def _divide_pixel(rays, first, sides, planes, axes, near, count, crossings, polygon, shares):
    """Compute the shares of faces, if one covers a part of a pixel; return whether it does.

    `shares` takes the area of each face, and its first moments from the centre of the pixel.
    """
    if count > 2 or crossings == 0:
        return False
    k = 1 if near[1, 0] == 0 else 0
    other, crossed, is_shared = 1 - k, near[1, k], count == 2 and near[1, 0] * near[1, 1] > 0
    if crossed > MOST_CROSSINGS or (is_shared and crossings > 2):
        return False
    value, right, down = _view_from_pixel(rays, sides[near[2, k]], axes)
    if crossed == 1:
        share, at_right, at_down = divide_square(value, right, down)
    else:
        f = near[0, k]
        share, at_right, at_down = _clip_square(rays, sides[first[f] : first[f + 1]], axes, polygon)
    shares[k, 0], shares[k, 1], shares[k, 2] = share, at_right, at_down
    if count == 1:
        return True
    shares[other, 0], shares[other, 1], shares[other, 2] = 1.0 - share, -at_right, -at_down
    if is_shared:  # both have the same side, or the pixel is divided twice
        a, b, c = _view_from_pixel(rays, sides[near[2, other]], axes)
        scale = max(abs(b), abs(c)) / max(abs(right), abs(down))
        gap = max(abs(a + scale * value), abs(b + scale * right), abs(c + scale * down))
        return gap <= SAME_LINE * max(abs(b), abs(c))
    value, right, down = _compare_depths(rays, planes, near[0, k], near[0, other], axes)
    return value > 0.5 * (abs(right) + abs(down))  # the divided face is in front


@routine
def _clip_square(rays, sides, axes, polygon):
    """Return the area of a pixel inside all sides of a face, and its moments.

    The pixel is cut by one side after the other (Sutherland and Hodgman 1974, "Reentrant polygon
    clipping"). `polygon` (2, 2, 4 + MOST_CROSSINGS) has room for the corners before and after.
    """
    n, now = 4, 0
    for i in range(4):
        polygon[0, 0, i] = -0.5 if i in (0, 3) else 0.5
        polygon[0, 1, i] = -0.5 if i < 2 else 0.5
    for i in range(len(sides)):
        value, right, down = _view_from_pixel(rays, sides[i], axes)
        if value < 0.5 * (abs(right) + abs(down)):
            n = _cut_polygon(value, right, down, polygon[now], n, polygon[1 - now])
            now = 1 - now
    return _measure_polygon(polygon[now], n)


@routine
def _cut_polygon(value, right, down, polygon, n, out):
    """Compute the part of a convex polygon where value + right x + down y >= 0; return its size."""
    kept, x, y = 0, polygon[0, n - 1], polygon[1, n - 1]
    here = value + right * x + down * y
    for i in range(n):
        before, x_before, y_before = here, x, y
        x, y = polygon[0, i], polygon[1, i]
        here = value + right * x + down * y
        if (here >= 0.0) != (before >= 0.0):
            t = before / (before - here)
            out[0, kept], out[1, kept] = (
                x_before + t * (x - x_before),
                y_before + t * (y - y_before),
            )
            kept += 1
        if here >= 0.0:
            out[0, kept], out[1, kept] = x, y
            kept += 1
    return kept


@routine
def _measure_polygon(polygon, n):
    """Return the area of a polygon, and its moments."""
    area, along, down = 0.0, 0.0, 0.0
    for i in range(n):
        j = i - 1 if i > 0 else n - 1
        x, y, u, v = polygon[0, j], polygon[1, j], polygon[0, i], polygon[1, i]
        cross = x * v - u * y
        area += 0.5 * cross
        along += (x + u) * cross / 6.0
        down += (y + v) * cross / 6.0
    return area, along, down


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


@fragment
def _count_hits(rays, first, sides, planes, pattern, axes, near, count, shares):
    """Compute the share of the places in a pixel that see each face, and their moments.

    `near` takes the places inside all sides of each face, as bits.
    """
    inside = near[2]
    for k in range(count):
        f, inside[k] = near[0, k], ALL_PLACES
        for i in range(first[f], first[f + 1]):
            value, right, down = _view_from_pixel(rays, sides[i], axes)
            if value < 0.5 * (abs(right) + abs(down)):
                inside[k] &= _find_positive(value, right, down, pattern)
        value, right, down = _view_from_pixel(rays, planes[near[0, k], 2], axes)
        if value < 0.5 * (abs(right) + abs(down)):  # the plane of the face passes the eye
            inside[k] &= _find_positive(value, right, down, pattern)
        for j in range(k):  # of two faces, the nearer one keeps the places of both
            both = inside[j] & inside[k]
            if both != 0:
                gap = _compare_depths(rays, planes, near[0, j], near[0, k], axes)
                nearer = _find_positive(*gap, pattern)
                inside[k] &= ~(both & nearer)
                inside[j] &= ~(both & ~nearer)
    for k in range(count):
        area, across, along, bits = 0, np.float32(0.0), np.float32(0.0), inside[k]
        for s in range(PLACES if bits != 0 else 0):
            hit = np.int32(bits >> s & 1)
            area += hit
            across += hit * pattern[0, s]
            along += hit * pattern[1, s]
        shares[k, 0] = area / PLACES
        shares[k, 1], shares[k, 2] = across / PLACES, along / PLACES


@fragment
def _find_positive(value, right, down, pattern):
    """Return the places of a pixel where an affine function is not negative, as bits."""
    value, right, down = np.float32(value), np.float32(right), np.float32(down)
    bits, across, along = np.int32(0), pattern[0], pattern[1]
    for s in range(PLACES):
        is_positive = value + right * across[s] + down * along[s] >= np.float32(0.0)
        bits |= np.int32(1 << s) if is_positive else np.int32(0)
    return np.int64(bits)
