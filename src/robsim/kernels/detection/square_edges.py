"""The corners of tags from the edges of their black squares, near their last places.

Each side is first searched on a few lines across it, and then fitted to the grey values across it
as `robsim.vision.tags.edges` explains: a straight line and a bow along the offsets of an ideal edge
with the same sum of grey values.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from robsim.kernels.machine.array_views import as_bytes
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.intrinsics import fragment, routine
from robsim.kernels.machine.kernel import part

ROUNDS = 6
COARSE, FINE = 1.0, 0.5  # pixels between the lines of a side in the first rounds and in the last
SETTLED, SAME_WIDTH = 0.02, 0.25  # pixels: changes before the last round
CELL_SHARE, LEAST_REACH, MOST_REACH = 0.4, 1.5, 4.0  # half length of a line: in cells, and limits
FAINT = 5.0  # smallest difference of grey values between both sides of an edge
BLURS, CLEAR = 2.0, 0.5  # half length of a line in deviations of the blur; distance to other sides
LARGEST_GAP = 0.33  # largest share of the shortest side without lines, at each end
CORRELATED = 0.9  # largest correlation of neighbouring offsets
TINY = 1e-20
SURE = 2.0  # smallest mean square of bows that count, relative to their variance
LEAST_LINES, MOST_LINES = 8, 1024
MOST_SAMPLES = 40  # on a line
CROSSING = 0.05  # smallest sine of the angle between two sides
SEARCHED, MOST_SEARCHED = 6.0, 24  # pixels between the lines of a search, and their number
FEWEST_SEARCHED = 8
SIDE_SAMPLES = 3  # pixels on each side of a searched edge
ON_LINE = 1.0  # pixels: searched edges that are closer to a line belong to it
CELLS_AWAY = 1.5  # cells: another edge of a tag may be farther from its border
BORDER_PLACES = 12  # of a side, where the cells of the border are compared
LEAST_TRUE = 0.9  # share of the places at each side that must be dark inside and light outside


class EdgeLines(NamedTuple):
    """The lines across a side: t, their places along it, from 0 to 1; x and y, of their ends.

    total, sums of the grey values along each line, later the offsets of the edge; dark and light,
    means at both ends. The others hold a sample of each line: the fractions a and b of its place
    between four pixels; index, of the upper left pixel; left, right, low, high, its four grey
    values; and grey.
    """

    t: Any
    x: Any
    y: Any
    total: Any
    dark: Any
    light: Any
    a: Any
    b: Any
    index: Any
    left: Any
    right: Any
    low: Any
    high: Any
    grey: Any


class SquareBuffers(NamedTuple):
    """Numbers of a square: its corners now, at the start of the fits and moved, each (4, 2).

    offsets (4, 2), at both ends of each side; fits (4, 7), of `_fit_side`; bows (4,); border (2,
    48), grey values inside and outside.
    """

    now: Any
    start: Any
    moved: Any
    offsets: Any
    fits: Any
    bows: Any
    border: Any


@part
def _allocate_square():
    """Return room for a square."""
    corners, border = np.empty((4, 4, 2)), np.empty((2, 4 * BORDER_PLACES))
    return SquareBuffers(
        *(corners[0], corners[1], corners[2], corners[3]), np.empty((4, 7)), np.empty(4), border
    )


@part
def _allocate_lines():
    """Return room for the lines of a side."""
    w, p = np.empty((8, MOST_LINES)), np.empty((5, MOST_LINES), np.int32)
    return EdgeLines(
        *(w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], p[0], p[1], p[2], p[3], p[4]),
        np.empty(MOST_LINES),
    )


@entry(
    "uint8[:, :, ::1], float64[:, :, :, ::1], bool[:, :, ::1], int64, float64, "
    "out float64[:, :, :, ::1]"
)
def follow_squares(pictures, last, patterns, most_wrong, reach, out):
    """Compute the corners out (B, T, 4, 2) of tags in pictures (B, h, w), NaN if they are lost.

    Parameters
    ----------
    pictures : array of uint8, shape (B, h, w)
        Grey pictures.
    last : array of shape (B, T, 4, 2)
        Last places of the corners, clockwise in the picture.
    patterns : array of bool, shape (T, n, n)
        Whether the cells of each tag are black; the outer ones are, with a white cell around them.
    most_wrong : int
        Largest number of inner cells with the wrong colour; negative: the cells are not read.
    reach : float
        Largest motion of a side, in pixels.
    out : array of shape (B, T, 4, 2)
        Corners, the result.
    """
    lines, square, cells = _allocate_lines(), _allocate_square(), float(patterns.shape[1])
    now, start = square.now, square.start
    for b in range(len(pictures)):
        height, width = pictures[b].shape
        flat = as_bytes(pictures[b])
        for n in range(last.shape[1]):
            _fill_corners(np.nan, out[b, n])
            cell = _find_cell(last[b, n], cells)
            if not cell > 0.0:
                continue
            if not _search_sides(flat, width, height, last[b, n], cell, reach, lines, square):
                continue
            cell = _find_cell(start, cells)
            if not _fit_corners(flat, width, height, cell, lines, square):
                continue
            threshold = _find_border_threshold(flat, width, height, now, cells, square.border)
            if not math.isfinite(threshold):
                continue
            if most_wrong < 0 or _match_cells(flat, width, now, patterns[n], threshold, most_wrong):
                _copy_corners(now, out[b, n])


@fragment
def _fill_corners(value, out):
    """Enter a value into all coordinates of corners."""
    for k in range(4):
        out[k, 0] = out[k, 1] = value


@fragment
def _copy_corners(corners, out):
    """Copy corners. A slice as a target would compile texts of errors for seconds."""
    for k in range(4):
        out[k, 0], out[k, 1] = corners[k, 0], corners[k, 1]


@fragment
def _find_largest_step(corners, other):
    """Return the largest difference of the coordinates of corners."""
    largest = 0.0
    for k in range(4):
        for i in range(2):
            step = abs(corners[k, i] - other[k, i])
            if not step <= largest:
                largest = step if math.isfinite(step) else math.inf
    return largest


@routine
def _find_cell(corners, cells):
    """Return the smallest width of the cells of a square; NaN or less than 0 if it is none."""
    least = np.inf
    for k in range(4):
        a, b, c = corners[k], corners[(k + 1) % 4], corners[(k + 3) % 4]
        x, y, u, v = b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]
        longer = max(math.hypot(x, y), math.hypot(u, v))
        least = min(least, (x * v - y * u) / longer)
        if not math.isfinite(x + y):
            return np.nan
    return least / cells


@fragment
def _sample(flat, width, x, y):
    """Return the grey value at a place in the picture, between four pixels."""
    i, j = int(x), int(y)
    p, a, b = np.uint64(j * width + i), x - i, y - j
    q, one = p + np.uint64(width), np.uint64(1)
    left, right = float(flat[p]), float(flat[p + one])
    low, high = float(flat[q]), float(flat[q + one])
    top, bottom = left + a * (right - left), low + a * (high - low)
    return top + b * (bottom - top)


@fragment
def _is_inside(width, height, x, y):
    """Return whether four pixels are around a place."""
    return 0.0 <= x < width - 1.0 and 0.0 <= y < height - 1.0


@routine
def _search_sides(flat, width, height, corners, cell, reach, lines, square):
    """Compute the corners `start` of the sides near other corners; return whether all are found."""
    reach = min(reach, CELLS_AWAY * cell)
    half = min(SIDE_SAMPLES, max(int(0.5 * cell), 1))
    for k in range(4):
        a, b = corners[k], corners[(k + 1) % 4]
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        count = min(max(int(length / SEARCHED), FEWEST_SEARCHED), MOST_SEARCHED)
        ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        margin, n = min(reach / length, 0.25), 0
        for line in range(count):
            t = margin + (1.0 - 2.0 * margin) * line / (count - 1)
            x, y = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])
            offset = _search_line(flat, width, height, x, y, uy, -ux, reach, half)
            if math.isfinite(offset):
                lines.t[n], lines.total[n] = t, offset
                n += 1
        if not _fit_most_edges(lines.t[:n], lines.total[:n], square.offsets[k]):
            return False
    return _move_sides(corners, square.offsets, square.start)


@routine
def _search_line(flat, width, height, x, y, nx, ny, reach, half):
    """Return the offset of the strongest edge from dark to light on a line; NaN if none."""
    steps = math.ceil(reach)
    far = float(steps + half)
    if not (
        _is_inside(width, height, x - far * nx, y - far * ny)
        and _is_inside(width, height, x + far * nx, y + far * ny)
    ):
        return np.nan
    difference = 0.0  # light minus dark at the first offset, -steps
    for i in range(half):
        s = -steps + 0.5 + i
        difference += _sample(flat, width, x + s * nx, y + s * ny)
        s = -steps - 0.5 - i
        difference -= _sample(flat, width, x + s * nx, y + s * ny)
    best, where = FAINT * half, np.nan
    for s in range(-steps, steps + 1):
        if difference > best:
            best, where = difference, float(s)
        if s < steps:
            middle = _sample(flat, width, x + (s + 0.5) * nx, y + (s + 0.5) * ny)
            outer, inner = s + half + 0.5, s - half + 0.5
            difference += _sample(flat, width, x + outer * nx, y + outer * ny)
            difference += _sample(flat, width, x + inner * nx, y + inner * ny) - 2.0 * middle
    return where


@routine
def _fit_most_edges(t, offset, out):
    """Compute the offsets out (2,) at the ends of a side, of the line with the most edges."""
    n, most, best_i, best_j = len(t), 0, -1, -1
    for i in range(n):
        for j in range(i + n // 3, n):
            if i == j:
                continue
            slope, count = (offset[j] - offset[i]) / (t[j] - t[i]), 0
            for k in range(n):
                count += abs(offset[i] + slope * (t[k] - t[i]) - offset[k]) < ON_LINE
            if count > most:
                most, best_i, best_j = count, i, j
    if 2 * most <= n or most < FEWEST_SEARCHED // 2:
        return False
    slope = (offset[best_j] - offset[best_i]) / (t[best_j] - t[best_i])
    aa, ab, bb, ya, yb = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        if abs(offset[best_i] + slope * (t[k] - t[best_i]) - offset[k]) < ON_LINE:
            a, b = 1.0 - t[k], t[k]
            aa, ab, bb = aa + a * a, ab + a * b, bb + b * b
            ya, yb = ya + a * offset[k], yb + b * offset[k]
    square = aa * bb - ab * ab
    out[0], out[1] = (bb * ya - ab * yb) / square, (aa * yb - ab * ya) / square
    return True


@routine
def _move_sides(corners, offsets, out):
    """Compute the corners of sides that move outwards by offsets (4, 2) at their ends.

    Return False if two neighbouring sides are nearly parallel.
    """
    for k in range(4):
        before, after = corners[(k + 3) % 4], corners[(k + 1) % 4]
        x, y = corners[k, 0] - before[0], corners[k, 1] - before[1]
        u, v = after[0] - corners[k, 0], after[1] - corners[k, 1]
        first, second = math.hypot(x, y), math.hypot(u, v)
        ax, ay, bx, by = y / first, -x / first, v / second, -u / second
        sine = ax * by - ay * bx
        if not abs(sine) > CROSSING:
            return False
        d, e = offsets[(k + 3) % 4, 1], offsets[k, 0]
        out[k, 0] = corners[k, 0] + (by * d - ay * e) / sine
        out[k, 1] = corners[k, 1] + (ax * e - bx * d) / sine
    return True


@routine
def _fit_corners(flat, width, height, cell, lines, square):
    """Compute the corners `now` of fitted sides; return whether all sides have an edge."""
    now, moved, offsets = square.now, square.moved, square.offsets
    fits, bows = square.fits, square.bows
    widest = min(max(CELL_SHARE * cell, LEAST_REACH), MOST_REACH)
    w, gap, spacing = widest, widest + 1.0, COARSE
    _copy_corners(square.start, now)
    for k in range(4):
        bows[k] = 0.0
    for _ in range(ROUNDS):
        certainty, shortest = 0.0, np.inf
        for k in range(4):
            a, b = now[k], now[(k + 1) % 4]
            shortest = min(shortest, math.hypot(b[0] - a[0], b[1] - a[1]))
            if not _fit_side(
                *(flat, width, height, a, b, bows[k], w, gap, spacing, lines, fits[k])
            ):
                return False
            certainty += 0.25 * fits[k, 3]
        a, b, c, d = fits[0, 4], fits[1, 4], fits[2, 4], fits[3, 4]
        blur = 0.5 * (a + b + c + d - max(a, b, c, d) - min(a, b, c, d))  # the median
        trust = 1.0 - SURE / max(certainty, SURE)
        for k in range(4):
            bows[k] = trust * fits[k, 2]
            offsets[k, 0] = fits[k, 0] - bows[k] * fits[k, 5]
            offsets[k, 1] = fits[k, 1] - bows[k] * fits[k, 6]
        if not _move_sides(now, offsets, moved):
            return False
        shift = _find_largest_step(moved, now)
        _copy_corners(moved, now)
        if not _find_largest_step(now, square.start) < max(cell, 2.0):
            return False
        if spacing == FINE:
            return True
        before, blurred = w, BLURS * blur
        w = min(max(blurred, LEAST_REACH), widest)
        gap = min(blurred + CLEAR, LARGEST_GAP * shortest)
        if shift < SETTLED and abs(w - before) < SAME_WIDTH:
            spacing = FINE
    return True


@routine
def _fit_side(flat, width, height, a, b, bow, w, gap, spacing, lines, out):
    """Compute the fit of the edge from a to b; return whether the fit has a result.

    `out` are the outward offsets of both ends of a straight edge, the bow, the square of the
    bow relative to its variance, the deviation of the blur, and the projection of a bow on both
    ends.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.hypot(dx, dy)
    if not gap < 0.4 * length:
        return False
    count = min(max(int(length / spacing), 12), MOST_LINES)
    samples = min(2 * round(w / (0.5 * spacing)) + 1, MOST_SAMPLES)
    n, step = 0, 2.0 * w / (samples - 1)
    margin, nx, ny = gap / length, dy / length, -dx / length
    for line in range(count):
        t = margin + (1.0 - 2.0 * margin) * line / (count - 1)
        first = bow * t * (1.0 - t) - w
        x, y = a[0] + t * dx + first * nx, a[1] + t * dy + first * ny
        if _is_inside(width, height, x, y) and _is_inside(
            width, height, x + 2.0 * w * nx, y + 2.0 * w * ny
        ):
            lines.t[n], lines.x[n], lines.y[n] = t, x, y
            n += 1
    if n < LEAST_LINES:
        return False
    steepest = _sum_lines(flat, width, lines, n, samples, step * nx, step * ny)
    contrast = _find_offsets(lines, n, bow, w, step, samples)
    if not contrast > FAINT:
        return False
    _fit_bow(lines.t[:n], lines.total[:n], lines.grey[:n], out)
    out[4] = contrast * n * step / (math.sqrt(2.0 * math.pi) * max(steepest, TINY))
    return True


@fragment
def _sum_lines(flat, width, lines, n, samples, step_x, step_y):
    """Compute sums of grey values along n lines, and means at their ends; return the largest step.

    The largest step is the one between the sums of all lines at neighbouring samples.
    """
    total, dark, light = lines.total[:n], lines.dark[:n], lines.light[:n]
    for k in range(n):
        total[k], dark[k], light[k] = 0.0, 0.0, 0.0
    steepest, before, end = 0.0, np.inf, max(samples // 8, 1)
    for s in range(samples):
        _read_samples(flat, width, lines, n, s * step_x, s * step_y)
        grey, sums = lines.grey[:n], 0.0
        share = 0.5 if s in (0, samples - 1) else 1.0
        at_dark = 1.0 / end if s < end else 0.0
        at_light = 1.0 / end if s >= samples - end else 0.0
        for k in range(n):
            total[k] += share * grey[k]
            dark[k] += at_dark * grey[k]
            light[k] += at_light * grey[k]
        for k in range(n):
            sums += grey[k]
        steepest, before = max(steepest, sums - before), sums
    return steepest


@fragment
def _read_samples(flat, width, lines, n, shift_x, shift_y):
    """Compute the grey values at the places of n lines, moved by a shift.

    The three loops are apart because processors compute places and mixtures in registers of many
    numbers, but read pixels one by one.
    """
    x, y, a, b, index = lines.x[:n], lines.y[:n], lines.a[:n], lines.b[:n], lines.index[:n]
    w = np.int32(width)
    for k in range(n):
        u, v = x[k] + shift_x, y[k] + shift_y
        i, j = np.int32(u), np.int32(v)
        a[k], b[k] = u - i, v - j
        index[k] = j * w + i
    left, right, low, high = lines.left[:n], lines.right[:n], lines.low[:n], lines.high[:n]
    one, row = np.uint64(1), np.uint64(width)
    for k in range(n):
        p = np.uint64(index[k])  # unsigned numbers cannot count from the end
        q = p + row
        left[k], right[k], low[k], high[k] = flat[p], flat[p + one], flat[q], flat[q + one]
    grey = lines.grey[:n]
    for k in range(n):
        top, bottom = left[k] + a[k] * (right[k] - left[k]), low[k] + a[k] * (high[k] - low[k])
        grey[k] = top + b[k] * (bottom - top)


@fragment
def _find_offsets(lines, n, bow, w, step, samples):
    """Replace the sums of n lines by offsets of the edge; return the mean contrast, or 0."""
    t, total, mean = lines.t[:n], lines.total[:n], 0.0
    d0, d1 = _fit_line(t, lines.dark[:n])
    l0, l1 = _fit_line(t, lines.light[:n])
    if not min(l0 - d0, l1 - d1) > FAINT:
        return 0.0
    for k in range(n):
        dark, light = (1.0 - t[k]) * d0 + t[k] * d1, (1.0 - t[k]) * l0 + t[k] * l1
        white = (total[k] - (samples - 1) * dark) / (light - dark)
        total[k] = w - step * white + bow * t[k] * (1.0 - t[k])
        mean += light - dark
    return mean / n


@routine
def _fit_line(t, values):
    """Return the values at t = 0 and t = 1 of a line fitted to values."""
    aa, ab, bb, ya, yb = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(t)):
        a, b = 1.0 - t[k], t[k]
        aa, ab, bb = aa + a * a, ab + a * b, bb + b * b
        ya, yb = ya + a * values[k], yb + b * values[k]
    square = aa * bb - ab * ab
    return (bb * ya - ab * yb) / square, (aa * yb - ab * ya) / square


@routine
def _fit_bow(t, offsets, bows, out):
    """Compute the fit of a straight line and a bow t (1 - t) to the offsets of an edge.

    `bows` takes the bows t (1 - t).
    """
    n, square, product, power, lagged = len(t), 0.0, 0.0, 0.0, 0.0
    out[0], out[1] = _fit_line(t, offsets)
    for k in range(n):
        bows[k] = t[k] * (1.0 - t[k])
    p0, p1 = _fit_line(t, bows)
    for k in range(n):
        line, parabola = (1.0 - t[k]) * p0 + t[k] * p1, bows[k]
        rest = offsets[k] - (1.0 - t[k]) * out[0] - t[k] * out[1]
        square += (parabola - line) * (parabola - line)
        product += rest * (parabola - line)
    bow, before = product / square, 0.0
    for k in range(n):
        shape = bows[k] - (1.0 - t[k]) * p0 - t[k] * p1
        residual = offsets[k] - (1.0 - t[k]) * out[0] - t[k] * out[1] - bow * shape
        power += residual * residual
        lagged += residual * before
        before = residual
    power = max(power, TINY)
    correlation = min(max(lagged / power, 0.0), CORRELATED)
    variance = power / n * (1.0 + correlation) / (1.0 - correlation)
    out[2], out[3], out[5], out[6] = bow, bow * bow * square / variance, p0, p1


@routine
def _find_border_threshold(flat, width, height, corners, cells, grey):
    """Return the grey value between black and white cells along the sides.

    It is NaN unless the cells are black inside and white outside. `grey` takes their grey values.
    """
    middle_x = 0.25 * (corners[0, 0] + corners[1, 0] + corners[2, 0] + corners[3, 0])
    middle_y = 0.25 * (corners[0, 1] + corners[1, 1] + corners[2, 1] + corners[3, 1])
    inner, outer = 0.0, 0.0
    for side in range(2):
        size = 1.0 + (2 * side - 1) / cells  # of the square through the middle of the cells
        for k in range(4):
            a, b = corners[k], corners[(k + 1) % 4]
            for i in range(BORDER_PLACES):
                t = (i + 0.5) / BORDER_PLACES
                x = middle_x + size * (a[0] + t * (b[0] - a[0]) - middle_x)
                y = middle_y + size * (a[1] + t * (b[1] - a[1]) - middle_y)
                if not _is_inside(width, height, x, y):
                    return np.nan
                grey[side, k * BORDER_PLACES + i] = _sample(flat, width, x, y)
    for i in range(4 * BORDER_PLACES):
        inner += grey[0, i] / (4 * BORDER_PLACES)
        outer += grey[1, i] / (4 * BORDER_PLACES)
    threshold = 0.5 * (inner + outer)
    if outer - inner < FAINT:
        return np.nan
    for k in range(4):
        true = 0
        for i in range(k * BORDER_PLACES, (k + 1) * BORDER_PLACES):
            true += (grey[0, i] < threshold) + (grey[1, i] > threshold)
        if true < LEAST_TRUE * 2 * BORDER_PLACES:
            return np.nan
    return threshold


@routine
def _match_cells(flat, width, corners, pattern, threshold, most_wrong):
    """Return whether at most `most_wrong` of the cells within the border have the wrong colour.

    The grey value in the middle of a cell is compared. The middle follows from the homography of
    the corners (Heckbert 1989, section 2.2.3).
    """
    (ax, ay), (bx, by) = (corners[0, 0], corners[0, 1]), (corners[1, 0], corners[1, 1])
    (cx, cy), (dx, dy) = (corners[2, 0], corners[2, 1]), (corners[3, 0], corners[3, 1])
    square = (bx - cx) * (dy - cy) - (dx - cx) * (by - cy)
    x, y = ax - bx + cx - dx, ay - by + cy - dy
    g = (x * (dy - cy) - y * (dx - cx)) / square
    h = (y * (bx - cx) - x * (by - cy)) / square
    right_x, right_y = bx - ax + g * bx, by - ay + g * by
    down_x, down_y = dx - ax + h * dx, dy - ay + h * dy
    cells, wrong = len(pattern), 0
    for row in range(1, cells - 1):
        for column in range(1, cells - 1):
            u, v = (column + 0.5) / cells, (row + 0.5) / cells
            size = g * u + h * v + 1.0
            x, y = (right_x * u + down_x * v + ax) / size, (right_y * u + down_y * v + ay) / size
            wrong += (_sample(flat, width, x, y) < threshold) != pattern[row, column]
    return wrong <= most_wrong
