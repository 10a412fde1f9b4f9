"""The convex hull of points in a plane."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array


def outline(points: Array) -> Array:
    """Return the corners of the convex hull of points (N, 2), in order (Andrew 1979).

    >>> outline(np.array([[0.0, 0], [2, 0], [1, 0.5], [2, 2], [0, 2]])).tolist()
    [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
    """
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered
    return np.array(_half_hull(ordered) + _half_hull(ordered[::-1]))


def _half_hull(ordered: Array) -> list[Array]:
    """Return the corners of one half of the hull, without the last point."""
    hull: list[Array] = []
    for point in ordered:
        while len(hull) > 1 and np.linalg.det([hull[-1] - hull[-2], point - hull[-1]]) <= 0:
            hull.pop()
        hull.append(point)
    return hull[:-1]
