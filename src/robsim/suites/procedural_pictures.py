"""Pictures for posters, computed with the same bits on every machine."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.statistics.random_numbers import SUITES, uniform

KINDS = ("clouds", "stones", "prints")
MIDDLE, CONTRAST = 127.5, 45.0  # mean and standard deviation of the grey values


@lru_cache(32)
def draw_procedural_picture(
    kind: str, seed: int, width: int = 384, height: int = 288
) -> NDArray[np.uint8]:
    """Return the grey values (h, w) of a picture.

    Parameters
    ----------
    kind : {"clouds", "stones", "prints"}
        Noise of all frequencies, as natural pictures have; bright and dark discs with soft edges;
        or rectangles with sharp edges, as in print.
    seed : int
        Number of the picture.
    width, height : int
        Numbers of columns and rows.

    Returns
    -------
    ndarray of uint8, shape (h, w)
        Grey values, with a standard deviation of 45 before they are limited to 0 and 255.

    Examples
    --------
    >>> picture = draw_procedural_picture("clouds", 1)
    >>> picture.shape, picture.dtype
    ((288, 384), dtype('uint8'))
    """
    draw = {"clouds": _draw_clouds, "stones": _draw_stones, "prints": _draw_prints}[kind]
    values = draw(seed, width, height)
    values = values - _average(values)
    values = values * (CONTRAST / np.sqrt(_average(values * values)))
    return make_read_only(np.rint(np.clip(MIDDLE + values, 0, 255)).astype(np.uint8))


def _average(values: Array) -> float:
    """Return the mean of values (h, w), summed row by row in a fixed order."""
    total = np.zeros(values.shape[1])
    for row in values:
        total = total + row
    return sum(total.tolist()) / values.size


def _draw_clouds(seed: int, width: int, height: int) -> Array:
    """Return the sum of smooth noise on grids of 192, 96, ... 3 texels, halved by a factor 0.6."""
    total, weight = np.zeros((height, width)), 1.0
    for octave, spacing in enumerate((192, 96, 48, 24, 12, 6, 3)):
        total += weight * _draw_noise(100 * seed + octave, spacing, width, height)
        weight *= 0.6
    return total


def _draw_noise(seed: int, spacing: int, width: int, height: int) -> Array:
    """Return random numbers on a grid, interpolated by smooth steps (Perlin's value noise)."""
    rows, columns = height // spacing + 2, width // spacing + 2
    grid = uniform(seed, SUITES, rows, columns)
    y, fy = _find_cells(height, spacing)
    x, fx = _find_cells(width, spacing)
    left = grid[y][:, x] * (1.0 - fy[:, None]) + grid[y + 1][:, x] * fy[:, None]
    right = grid[y][:, x + 1] * (1.0 - fy[:, None]) + grid[y + 1][:, x + 1] * fy[:, None]
    mixed: Array = left * (1.0 - fx) + right * fx
    return mixed


def _find_cells(count: int, spacing: int) -> tuple[NDArray[np.int64], Array]:
    """Return the cells of texels, and their smooth places in them from 0 to 1."""
    cell, rest = np.divmod(np.arange(count), spacing)
    f = (rest + 0.5) / spacing
    return cell, f * f * (3.0 - 2.0 * f)


def _draw_stones(seed: int, width: int, height: int) -> Array:
    """Return 90 discs with radii of 6 to 40 texels and soft edges, the small ones on top."""
    u = uniform(1000 + seed, SUITES, 90, 4)
    y, x = np.mgrid[:height, :width]
    values = np.zeros((height, width))
    for k, (a, b, c, grey) in enumerate(u):
        radius = 40.0 - 34.0 * k / (len(u) - 1) * (0.7 + 0.3 * c)
        square = (x - a * width) ** 2 + (y - b * height) ** 2
        inside = np.clip((radius * radius - square) / (4.0 * radius) + 0.5, 0.0, 1.0)
        values = values + inside * (grey - values)
    return values


def _draw_prints(seed: int, width: int, height: int) -> Array:
    """Return 160 upright rectangles with sides of 4 to 60 texels, the small ones on top."""
    u = uniform(2000 + seed, SUITES, 160, 5)
    values = np.full((height, width), 0.5)
    for k, (a, b, c, d, grey) in enumerate(u):
        scale = 1.0 - 0.8 * k / (len(u) - 1)
        wide, high = (int(4 + 56 * scale * each) for each in (c, d))
        left, top = int(a * (width + wide)) - wide, int(b * (height + high)) - high
        rows = slice(max(top, 0), max(top + high, 0))
        values[rows, max(left, 0) : max(left + wide, 0)] = np.rint(3.0 * grey) / 3.0
    return values
