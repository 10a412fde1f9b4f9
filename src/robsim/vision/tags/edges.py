"""The corners of a tag from the edges of its black square, to a few hundredths of a pixel.

The corners of detectors have errors of a tenth of a pixel or more. Here each side is fitted again
to the grey values across it. On a line across the side, from -w to w, let B (black) and W (white)
be the grey values at the ends. An ideal edge at the offset e has the same sum of grey values as the
image if (e + w) B + (w - e) W = sum (the first moment of Tabatabai and Mitchell 1984). Symmetric
blur does not move this edge. A parabola is fitted to the offsets along a side, because lenses bend
sides, and a corner is the intersection of the fits of its two sides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array

ROUNDS = 5
REACH = 0.6, 1.5, 4.0  # half length w of a line: in cells, and its limits in pixels
STEP = 0.25  # pixels between the samples on a line
FAINT = 5.0  # smallest difference of grey values between white and black at an edge


def refine_corners(image: NDArray[np.uint8], corners: Array, cell: float) -> Array | None:
    """Return the refined corners (4, 2) of a black square, clockwise in the image, or None.

    `cell` is the side of a cell in pixels. The result is None if a side has no edge, or the corners
    move too far.
    """
    share, least, most = REACH
    w = min(max(share * cell, least), most)
    now = corners.copy()
    for _ in range(ROUNDS):
        offsets = [
            _edge_offsets(image, a, b, w) for a, b in zip(now, np.roll(now, -1, 0), strict=True)
        ]
        if any(each is None for each in offsets):
            return None
        now = now + _corner_shifts(now, np.array(offsets, dtype=float))
        if not np.abs(now - corners).max() < max(cell, 2.0):
            return None
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


def _edge_offsets(
    image: NDArray[np.uint8], a: Array, b: Array, w: float
) -> tuple[float, float] | None:
    """Return the outward offsets of the edge at the ends a and b of a side, in pixels, or None."""
    length = float(np.hypot(*(b - a)))
    margin = (w + 1) / length if length else 1.0  # stay away from the other sides
    if not margin < 0.4:
        return None
    t = np.linspace(margin, 1 - margin, max(int(2 * length), 12))
    s = np.linspace(-w, w, 2 * round(w / STEP) + 1)
    points = a + t[:, None, None] * (b - a) + s[:, None] * _outward_normal(a, b)
    grey = sample_image(image, points)
    whole = np.isfinite(grey).all(axis=1)
    if whole.sum() < 8:
        return None
    t, grey = t[whole], grey[whole]
    end = max(len(s) // 8, 1)
    dark, light = (_fit_line(t, part.mean(axis=1)) for part in (grey[:, :end], grey[:, -end:]))
    if not (light - dark).min() > FAINT:
        return None
    total = (grey[:, 1:] + grey[:, :-1]).sum(axis=1) / 2 * (s[1] - s[0])
    e = (w * (dark + light) - total) / (light - dark)
    bend = np.polynomial.polynomial.polyfit(t, e, 2)
    return float(bend[0]), float(bend.sum())


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
