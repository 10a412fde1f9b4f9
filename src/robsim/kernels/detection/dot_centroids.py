"""Grey centroids of dark or bright dots.

A dot is a connected set of dark pixels (its blob). The centroid weighs the pixels of the blob and
of a few layers of pixels around it by w = background - grey, so that pixels at the rim count by
their covered share. Bright dots are dark dots of the inverted picture.
"""

import math

import numpy as np

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.intrinsics import routine

COLUMN_STEPS = np.array([1, 0, -1, 0, 1, -1, -1, 1])
ROW_STEPS = np.array([0, 1, 0, -1, 1, 1, -1, -1])
LEAST_LAYERS, MOST_LAYERS = 3, 8  # of pixels around a blob; the last one is the background
STEADY = 0.02  # share of the contrast: two layers that differ less are both background
ALIEN = 0.4  # share of the contrast: pixels that are darker than the layer before by more
TRIES = 8  # blobs near a last place, of which too small ones are left out
LARGEST = 4  # a blob has at most a fourth of the pixels of the picture
# An ellipse has the area 4 pi sqrt(det C) with the covariance C of its points, which have distances
# d'C^-1 d up to 4 from its middle. Several dots have a smaller area, and a part of a dot has larger
# distances. Pixels make the area uncertain by up to 1.7 / area, and the distances by a share of up
# to 0.8 / sqrt(area) (40,000 random ellipses with axes of 2 to 16 pixels)
FULL, ROUGH = 0.98, 1.7
FARTHEST, ROUGH_RIM = 1.03, 0.9
PIXEL_VARIANCE = 1.0 / 12.0
SAME = 0.5  # pixels: centroids that are closer are of the same dot


@entry(
    "uint8[:, :, ::1], float64[:, :, ::1], float64, bool, float64, float64, out int32[:, ::1], "
    "out int32[::1], out float64[:, :, ::1]"
)
def find_dots(pictures, last, reach, is_bright, least_area, least_contrast, label, queue, out):
    """Compute the centroids out (B, N, 2) of dots in pictures (B, h, w), NaN if not found.

    Parameters
    ----------
    pictures : array of uint8, shape (B, h, w)
        Grey pictures.
    last : array of shape (B, N, 2)
        Last places of the dots, in pixels.
    reach : float
        Half width of the first window around a last place, in pixels.
    is_bright : bool
        Whether the dots are brighter than their background.
    least_area, least_contrast : float
        Smallest area in pixels, and smallest difference to the background in grey values.
    label : array of int32, shape (h, w)
        Zeros; overwritten.
    queue : array of int32, shape (h w,)
        Overwritten.
    out : array of shape (B, N, 2)
        Centroids (column, row), the result.
    """
    stamp, flip = 0, 255.0 if is_bright else 0.0
    for b in range(len(pictures)):
        for n in range(last.shape[1]):
            x, y, before = last[b, n, 0], last[b, n, 1], stamp
            out[b, n, 0], out[b, n, 1] = np.nan, np.nan
            threshold = _find_threshold(pictures[b], x, y, reach, flip, least_contrast)
            while stamp < before + TRIES:
                seed = _find_nearest_pixel(pictures[b], x, y, reach, flip, threshold, label, before)
                if seed < 0:
                    break
                stamp += 1
                area = _collect_blob(pictures[b], seed, flip, threshold, label, queue, stamp)
                if area >= least_area:
                    ends = _add_layers(pictures[b], area, flip, threshold, label, queue, stamp)
                    _measure_dot(pictures[b], area, ends, flip, least_contrast, queue, out[b, n])
                if area < 0 or area >= least_area:
                    break
        _drop_repeated_dots(last[b], out[b])


@routine
def _find_threshold(picture, x, y, reach, flip, least_contrast):
    """Return the middle between the extreme grey values near a place; NaN without a contrast.

    The window is doubled until it has a contrast, because it may lie in a large dot.
    """
    height, width = picture.shape
    if not (-reach <= x <= width - 1 + reach and -reach <= y <= height - 1 + reach):
        return np.nan
    while True:
        left, right = max(int(x - reach), 0), min(int(x + reach), width - 1)
        top, bottom = max(int(y - reach), 0), min(int(y + reach), height - 1)
        low, high = 255, 0
        for j in range(top, bottom + 1):
            for value in picture[j, left : right + 1]:
                low, high = min(low, value), max(high, value)
        if high - low >= least_contrast:
            return abs(flip - 0.5 * (low + high))
        if (right - left + 1) * (bottom - top + 1) == width * height:
            return np.nan
        reach *= 2.0


@routine
def _find_nearest_pixel(picture, x, y, reach, flip, threshold, label, before):
    """Return the dark pixel nearest to a place, but not in blobs with labels above `before`.

    It is -1 if there is none in the window.
    """
    height, width = picture.shape
    best, nearest = -1, np.inf
    if not math.isfinite(threshold):
        return best
    for j in range(max(int(y - reach), 0), min(int(y + reach), height - 1) + 1):
        for i in range(max(int(x - reach), 0), min(int(x + reach), width - 1) + 1):
            apart = (i - x) * (i - x) + (j - y) * (j - y)
            if abs(flip - picture[j, i]) < threshold and apart < nearest and label[j, i] <= before:
                best, nearest = j * width + i, apart
    return best


@routine
def _collect_blob(picture, seed, flip, threshold, label, queue, stamp):
    """Enter the pixels of a blob into the queue; return their number.

    It is -1 if the blob meets the border of the picture, or is too large.
    """
    height, width = picture.shape
    queue[0], tail, head = seed, 1, 0
    label[seed // width, seed % width] = stamp
    while head < tail:
        y, x = queue[head] // width, queue[head] % width
        head += 1
        if x == 0 or y == 0 or x == width - 1 or y == height - 1 or tail > len(queue) // LARGEST:
            return -1
        for k in range(len(ROW_STEPS)):
            j, i = y + ROW_STEPS[k], x + COLUMN_STEPS[k]
            if label[j, i] != stamp and abs(flip - picture[j, i]) < threshold:
                label[j, i] = stamp
                queue[tail] = j * width + i
                tail += 1
    return tail


@routine
def _add_layers(picture, area, flip, threshold, label, queue, stamp):
    """Enter layers of pixels around a blob into the queue; return the ends of the last two.

    The last layer is the background. Both ends are -1 if the layers meet the border of the picture,
    another blob or the end of the paper before the grey values are steady.
    """
    height, width = picture.shape
    start, end, before = 0, area, 255.0
    dark = _find_mean(picture, queue[:area], flip)
    for layer in range(1, MOST_LAYERS + 1):
        tail, total = end, 0.0
        least = threshold if layer == 1 else before - ALIEN * (before - dark)
        for head in range(start, end):
            y, x = queue[head] // width, queue[head] % width
            for k in range(len(ROW_STEPS)):
                j, i = y + ROW_STEPS[k], x + COLUMN_STEPS[k]
                if not (0 <= j < height and 0 <= i < width):
                    return -1, -1
                if label[j, i] == stamp:
                    continue
                value = abs(flip - picture[j, i])
                if value < least:
                    return -1, -1
                label[j, i] = stamp
                queue[tail] = j * width + i
                tail, total = tail + 1, total + value
        mean = total / (tail - end)
        if layer >= LEAST_LAYERS and abs(mean - before) < STEADY * (mean - dark):
            return end, tail
        start, end, before = end, tail, mean
    return -1, -1


@routine
def _measure_dot(picture, area, ends, flip, least_contrast, queue, out):
    """Compute the centroid out (2,) of a blob with its layers, unless it is no whole dot."""
    end, width = ends[0], picture.shape[1]
    if end < 0 or not _is_ellipse(queue, area, width):
        return
    background = _find_mean(picture, queue[end : ends[1]], flip)
    if background - _find_mean(picture, queue[:area], flip) < least_contrast:
        return
    first_y, first_x = queue[0] // width, queue[0] % width
    total, along, down = 0.0, 0.0, 0.0
    for k in range(end):
        y, x = queue[k] // width, queue[k] % width
        weight = background - abs(flip - picture[y, x])
        total += weight
        along += weight * (x - first_x)
        down += weight * (y - first_y)
    out[0], out[1] = first_x + along / total, first_y + down / total


@routine
def _find_mean(picture, places, flip):
    """Return the mean grey value of pixels."""
    total, width = 0.0, picture.shape[1]
    for place in places:
        total += abs(flip - picture[place // width, place % width])
    return total / len(places)


@routine
def _is_ellipse(queue, area, width):
    """Return whether the first pixels of the queue fill an ellipse."""
    first_y, first_x = queue[0] // width, queue[0] % width
    sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(area):
        x, y = float(queue[k] % width - first_x), float(queue[k] // width - first_y)
        sx, sy = sx + x, sy + y
        sxx, sxy, syy = sxx + x * x, sxy + x * y, syy + y * y
    x, y = sx / area, sy / area
    cxx, cyy = sxx / area - x * x + PIXEL_VARIANCE, syy / area - y * y + PIXEL_VARIANCE
    cxy = sxy / area - x * y
    square = cxx * cyy - cxy * cxy
    if area < (FULL - ROUGH / area) * 4.0 * math.pi * math.sqrt(square):
        return False
    farthest = 0.0
    for k in range(area):
        i, j = queue[k] % width - first_x - x, queue[k] // width - first_y - y
        farthest = max(farthest, cyy * i * i - 2.0 * cxy * i * j + cxx * j * j)
    return farthest <= 4.0 * square * (FARTHEST + ROUGH_RIM / math.sqrt(area))


@routine
def _drop_repeated_dots(last, found):
    """Keep a dot that several marks found only for the mark with the nearest last place."""
    for i in range(len(found)):
        for j in range(i):
            apart = math.hypot(found[i, 0] - found[j, 0], found[i, 1] - found[j, 1])
            if apart < SAME:
                moved_i = math.hypot(found[i, 0] - last[i, 0], found[i, 1] - last[i, 1])
                moved_j = math.hypot(found[j, 0] - last[j, 0], found[j, 1] - last[j, 1])
                dropped = i if moved_i >= moved_j else j
                found[dropped, 0] = found[dropped, 1] = np.nan
