"""Polygons as ranges of an array of corners, and as paths of Matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.path import Path
from numpy.typing import NDArray

from robsim.base.arrays import Array

Indices = NDArray[np.int64]


def expand_ranges(starts: Indices, counts: Indices) -> Indices:
    """Return the indices start, start + 1 and so on of ranges, range by range."""
    ends = np.cumsum(counts)
    return np.arange(ends[-1] if len(ends) else 0) + np.repeat(starts - ends + counts, counts)


def list_following(starts: Indices, counts: Indices) -> Indices:
    """Return the index of the next corner of its polygon, for each corner of all polygons."""
    following = np.arange(1, int(counts.sum()) + 1)
    following[starts + counts - 1] = starts
    return following


class PolygonPool:
    """Closed polygons as paths of Matplotlib, which are used again for other corners."""

    def __init__(self) -> None:
        self._paths: dict[int, list[Any]] = {}  # by number of corners

    def build(self, corners: Array, counts: Indices) -> list[Any]:
        """Return polygons with some numbers of consecutive corners (N, 2)."""
        ends = np.cumsum(counts)
        closed = np.insert(corners, ends, corners[ends - counts], axis=0)
        for n, number in zip(*np.unique(counts, return_counts=True), strict=True):
            known = self._paths.setdefault(int(n), [])
            known += [Path(np.zeros((n + 1, 2)), closed=True) for _ in range(number - len(known))]
        free, paths, start = {n: iter(known) for n, known in self._paths.items()}, [], 0
        for n in counts.tolist():
            path = next(free[n])
            path._vertices = closed[start : start + n + 1]
            paths.append(path)
            start += n + 1
        return paths
