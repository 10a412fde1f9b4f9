"""Circles as polygons, and surfaces of revolution about z: circles with a pole at either end."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.primitives.primitive import Face


def circle_points(radius: float, n: int) -> Array:
    """Return n points (n, 2) of a circle about the origin, the first at angle 0."""
    angle = 2 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def unit_circle_points(angle: Array) -> Array:
    """Return the points (n, 3) of the unit circle about z at angles (n,) in radians."""
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])


def hemisphere_rings(radius: float, n: int) -> tuple[Array, Array]:
    """Return radii and heights of circles on a hemisphere, from the equator up, without the pole.

    The circles are about as far apart as n points of the equator.
    """
    count = max(n // 4, 1)
    angle = np.pi / 2 * np.arange(count) / count
    return radius * np.cos(angle), radius * np.sin(angle)


def revolution_points(radii: Array, heights: Array, top: float, n: int) -> Array:
    """Return n points (n, 3) of each circle, the lowest first, and the poles at -top and top."""
    unit = unit_circle_points(2 * np.pi * np.arange(n) / n)
    rings = radii[:, None, None] * unit + heights[:, None, None] * np.array([0.0, 0.0, 1.0])
    return np.concatenate([rings.reshape(-1, 3), [[0.0, 0.0, -top], [0.0, 0.0, top]]])


def revolution_faces(rings: int, n: int, first: int = 0) -> tuple[Face, ...]:
    """Return the outward faces between circles of n points and two poles, from index `first` on."""
    sides = [(i, (i + 1) % n) for i in range(n)]
    starts = range(first, first + n * (rings - 1), n)
    tread = [(s + i, s + j, s + j + n, s + i + n) for s in starts for i, j in sides]
    last, low = first + n * (rings - 1), first + n * rings
    below = [(low, first + j, first + i) for i, j in sides]
    return (*tread, *below, *((low + 1, last + i, last + j) for i, j in sides))
