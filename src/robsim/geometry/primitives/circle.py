"""Circles as polygons of n points, for drawing."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError

MOST_POINTS = 4096  # in a circle


def circle(radius: float, n: int) -> Array:
    """Return n points (n, 2) of a circle, the first at angle 0."""
    angle = 2 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def on_circle(angle: Array) -> Array:
    """Return the points (n, 3) of the unit circle about z at angles (n,) in radians."""
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])


def check_points(n: object, kind: str) -> None:
    """Raise InputError unless n is a number of points that can draw a circle."""
    if not isinstance(n, int | np.integer) or not 3 <= n <= MOST_POINTS:
        raise InputError(
            f"{kind} n must be a whole number of at least 3, got {n!r}; and at most {MOST_POINTS}"
        )
