"""Polygons as ranges of an array of corners, and as paths of Matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

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


@dataclass(frozen=True)
class FaceArrays:
    """Faces in space as arrays; moved faces share all but the corners.

    Attributes
    ----------
    corners : array of shape (N, 3)
        Corners of all faces, face by face.
    starts, counts : array of int, shape (F,)
        First corner of each face, and number of its corners.
    following : array of int, shape (N,)
        Index of the next corner of its face, for each corner.
    """

    corners: Array
    starts: Indices
    counts: Indices
    following: Indices

    @classmethod
    def of(cls, faces: Sequence[Array]) -> Self:
        """Return faces, each (n, 3), as arrays."""
        counts = np.array([len(face) for face in faces], dtype=np.int64)
        starts = np.cumsum(counts) - counts
        return cls(join_faces(faces), starts, counts, list_following(starts, counts))

    def move(self, faces: Sequence[Array]) -> Self:
        """Return the same faces at other places."""
        return replace(self, corners=join_faces(faces))


def join_faces(faces: Sequence[Array]) -> Array:
    """Return the corners (N, 3) of all faces, each (n, 3)."""
    return np.concatenate(faces) if len(faces) else np.zeros((0, 3))


def grow_polygons(corners: Array, starts: Indices, counts: Indices, width: Array) -> Array:
    """Return convex polygons with each side moved outwards, and each corner cut off.

    `corners` (N, 2) are those of all polygons, and `width` (N,) are the distances. Each corner
    becomes two, the end of one side and the start of the next: the corners are (2 N, 2).
    """
    following = list_following(starts, counts)
    sides = corners[following] - corners
    area = np.add.reduceat(corners[:, 0] * sides[:, 1] - corners[:, 1] * sides[:, 0], starts)
    lengths = np.maximum(np.hypot(sides[:, 0], sides[:, 1]), 1e-300)
    out = np.where(area < 0, -1.0, 1.0).repeat(counts) * width / lengths
    moves = np.column_stack([sides[:, 1] * out, -sides[:, 0] * out])
    grown = np.empty((len(corners), 2, 2))
    grown[:, 1] = corners + moves
    grown[following, 0] = corners[following] + moves
    return grown.reshape(-1, 2)


class PathPool:
    """Paths of Matplotlib that consist of several polygons or lines, used again for others."""

    def __init__(self) -> None:
        self._paths: list[Any] = []

    def build(self, corners: Array, codes: NDArray[np.uint8], ends: Indices) -> list[Any]:
        """Return paths of consecutive corners (N, 2) with their codes; `ends` are their ends."""
        missing = len(ends) - len(self._paths)
        self._paths += [Path(np.zeros((1, 2)), [Path.MOVETO]) for _ in range(missing)]
        paths, start = self._paths[: len(ends)], 0
        for path, end in zip(paths, ends.tolist(), strict=True):
            path._vertices, path._codes = corners[start:end], codes[start:end]
            start = end
        return paths
