"""The corners of a tag from the edges of its black square, to a few thousandths of a pixel.

The corners of detectors have errors of a hundredth of a pixel or more. Here each side is fitted
again to the grey values across it. On a line across the side, from -w to w, let B (black) and W
(white) be the grey values at the ends. An ideal edge at the offset e has the same sum of grey
values as the image if (e + w) B + (w - e) W = sum (the first moment of Tabatabai and Mitchell
1984). Symmetric blur does not move this edge. Every grey value of the sum adds noise, so w is only
as long as the blur requires.

The offsets along a side are fitted by a straight line and by a bow, because lenses bend sides. A
corner is the intersection of the fits of its two sides. The extrapolation to the corners multiplies
the noise of the bows. They therefore count as far as they exceed their standard deviations on all
four sides (the positive-part estimator of James and Stein 1961).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array

ROUNDS = 5
REACH = 0.4, 1.5, 4.0  # largest half length w of a line: in cells, and its limits in pixels
STEP = 0.25  # pixels between the samples on a line
FAINT = 5.0  # smallest difference of grey values between white and black at an edge
BLURS = 2.0  # half length w of a line, in standard deviations of the blur
CLEAR = 0.5  # pixels between the lines of a side and the blurred neighbouring sides
LARGEST_GAP = 0.33  # largest share of the shortest side that has no lines, at each end
CORRELATED = 0.9  # largest correlation that is assumed between neighbouring offsets
TINY = 1e-20  # square pixels: an exact edge has no residual
SURE = 2.0  # smallest mean square of bows that count, relative to their variance


class EdgeFit(NamedTuple):
    """The edge along a side, with the offsets e(t) = (1 - t) e(0) + t e(1) + bow t (1 - t)."""

    straight: Array  # outward offsets (2,) of the corners without a bow, in pixels
    bow: float  # outward, in pixels
    per_bow: Array  # change (2,) of the offsets of the corners for each pixel of bow
    certainty: float  # square of the bow relative to its variance
    blur: float  # standard deviation of the blur of the edge, in pixels

    def corner_offsets(self, share: float) -> Array:
        """Return the outward offsets (2,) of the corners for a share of the bow, in pixels."""
        return self.straight + share * self.bow * self.per_bow


def refine_corners(image: NDArray[np.uint8], corners: Array, cell: float) -> Array | None:
    """Return the refined corners (4, 2) of a black square, clockwise in the image, or None.

    `cell` is the side of a cell in pixels. The result is None if a side has no edge, or the corners
    move too far.
    """
    share, least, most = REACH
    widest = min(max(share * cell, least), most)
    now, bows, w, gap = corners.copy(), np.zeros(4), widest, widest + 1
    for _ in range(ROUNDS):
        sides = zip(now, np.roll(now, -1, 0), bows, strict=True)
        fits = [fit for a, b, bow in sides if (fit := _fit_edge(image, a, b, bow, w, gap))]
        if len(fits) < 4:
            return None
        certainty = float(np.mean([fit.certainty for fit in fits]))
        trust = 1 - SURE / max(certainty, SURE)
        bows = trust * np.array([fit.bow for fit in fits])
        now = now + _corner_shifts(now, np.array([fit.corner_offsets(trust) for fit in fits]))
        if not np.abs(now - corners).max() < max(cell, 2.0):
            return None
        blurred = BLURS * float(np.median([fit.blur for fit in fits]))
        shortest = float(np.hypot(*(now - np.roll(now, 1, 0)).T).min())
        w, gap = min(max(blurred, least), widest), min(blurred + CLEAR, LARGEST_GAP * shortest)
    return now


def sample_image(image: NDArray[np.uint8], points: Array) -> Array:
    """Return bilinearly interpolated grey values (...) at points (..., 2), NaN outside."""
    h, w = image.shape
    x, y = points[..., 0], points[..., 1]
    inside = (x >= 0) & (y >= 0) & (x <= w - 1) & (y <= h - 1)
    x, y = np.where(inside, x, 0), np.where(inside, y, 0)
    i, j = (np.clip(np.floor(v), 0, n - 2) for v, n in ((x, w), (y, h)))
    a, b, i, j = x - i, y - j, i.astype(int), j.astype(int)
    above = (1 - a) * image[j, i] + a * image[j, i + 1]
    below = (1 - a) * image[j + 1, i] + a * image[j + 1, i + 1]
    return np.where(inside, (1 - b) * above + b * below, np.nan)


def _outward_normal(a: Array, b: Array) -> Array:
    """Return the unit normal of a side; it points out of a square with clockwise corners."""
    along = (b - a) / np.hypot(*(b - a))
    return np.array([along[1], -along[0]])


def _fit_edge(
    image: NDArray[np.uint8], a: Array, b: Array, bow: float, w: float, gap: float
) -> EdgeFit | None:
    """Return the edge along the side from a to b, or None if there is no edge.

    Lines of the half length w cross the side with a bow, except for a gap in pixels at its ends.
    """
    length = float(np.hypot(*(b - a)))
    margin = gap / length if length else 1.0
    if not margin < 0.4:
        return None
    t = np.linspace(margin, 1 - margin, max(int(2 * length), 12))
    s = np.linspace(-w, w, 2 * round(w / STEP) + 1)
    curve = bow * t * (1 - t)
    points = (
        a + t[:, None, None] * (b - a) + (curve[:, None] + s)[..., None] * _outward_normal(a, b)
    )
    grey = sample_image(image, points)
    whole = np.isfinite(grey).all(axis=1)
    if whole.sum() < 8:
        return None
    t, grey, step = t[whole], grey[whole], s[1] - s[0]
    end = max(len(s) // 8, 1)
    dark, light = (_fit_line(t, part.mean(axis=1)) for part in (grey[:, :end], grey[:, -end:]))
    if not (light - dark).min() > FAINT:
        return None
    white = (grey - dark[:, None]) / (light - dark)[:, None]
    offsets = w - (white[:, 1:] + white[:, :-1]).sum(axis=1) / 2 * step + curve[whole]
    steepest = float(np.diff(white.mean(axis=0)).max()) / step
    return _fit_bow(t, offsets, blur=1 / (np.sqrt(2 * np.pi) * steepest))


def _fit_bow(t: Array, offsets: Array, blur: float) -> EdgeFit:
    """Return the fit of a straight line and a bow to the offsets of an edge, at shares t."""
    line, parabola = np.stack([1 - t, t], axis=1), t * (1 - t)
    both = np.stack([offsets, parabola], axis=1)
    straight, projected = np.linalg.lstsq(line, both, rcond=None)[0].T
    rest, shape = offsets - line @ straight, parabola - line @ projected
    bow = float(rest @ shape / (shape @ shape))
    residual = rest - bow * shape
    power = max(float(residual @ residual), TINY)
    correlation = min(max(float(residual[1:] @ residual[:-1]) / power, 0.0), CORRELATED)
    spread = power / len(t) * (1 + correlation) / (1 - correlation)  # neighbours share pixels
    certainty = bow**2 * float(shape @ shape) / spread
    return EdgeFit(straight, bow, -projected, certainty, blur)


def _fit_line(t: Array, values: Array) -> Array:
    """Return the values of a line fitted along a side, because illumination varies slowly."""
    start, slope = np.polynomial.polynomial.polyfit(t, values, 1)
    return np.asarray(start + slope * t)


def _corner_shifts(corners: Array, offsets: Array) -> Array:
    """Return the shifts (4, 2) of corners that move all sides by their offsets (4, 2)."""
    ends = zip(corners, np.roll(corners, -1, 0), strict=True)
    normals = np.array([_outward_normal(a, b) for a, b in ends])
    # normals of the sides before and after each corner
    normal_pairs = np.stack([np.roll(normals, 1, 0), normals], axis=1)
    offset_pairs = np.stack([np.roll(offsets[:, 1], 1), offsets[:, 0]], axis=1)
    crossing = np.abs(np.linalg.det(normal_pairs)) > 0.05  # else the sides are nearly one line
    shifts = np.full((4, 2), np.inf)
    shifts[crossing] = np.linalg.solve(normal_pairs[crossing], offset_pairs[crossing, :, None])[
        ..., 0
    ]
    return shifts
