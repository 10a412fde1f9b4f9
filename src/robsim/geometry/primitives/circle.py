"""Circles as polygons of n points, for drawing."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array


def circle(radius: float, n: int) -> Array:
    """Return n points (n, 2) of a circle, the first at angle 0."""
    angle = 2 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def on_circle(angle: Array) -> Array:
    """Return the points (n, 3) of the unit circle about z at angles (n,) in radians."""
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])
