"""The outlines of shadows of solids on the ground, for a lamp straight above."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.plot.convex_solids import compute_area_vectors, find_convex_solids, list_sides
from robsim.plot.polygons import FaceArrays
from robsim.plot.wireframe import WireSolid


class ShadowOutlines:
    """The outlines of the shadows of solids, computed anew for other poses of the same solids.

    A convex solid has one outline: the sides between the faces above and below. The faces of
    another solid have one each.
    """

    def __init__(self, solids: Sequence[WireSolid]) -> None:
        faces = [wire.faces for wire in solids]
        self._convex = find_convex_solids(faces)
        some = [each for each, convex in zip(faces, self._convex, strict=True) if convex]
        sizes = [sum(map(len, each)) for each in some]
        self._solid = np.repeat(np.arange(len(some)), sizes)  # of each corner
        self._faces = FaceArrays.of([face for each in some for face in each])
        counts = self._faces.counts
        self._face = np.repeat(np.arange(len(counts)), counts)
        self._opposite = _find_opposite_sides(some)

    def compute(self, solids: Sequence[WireSolid]) -> list[Array]:
        """Return the outlines, each (n, 3), at any height."""
        pairs = list(zip(solids, self._convex, strict=True))
        some = [wire.faces for wire, convex in pairs if convex]
        outlines = [face for wire, convex in pairs if not convex for face in wire.faces]
        if not some:
            return outlines
        faces = self._faces.move(list(chain.from_iterable(some)))
        above = (compute_area_vectors(faces)[:, 2] > 0)[self._face]
        border = np.flatnonzero(above & ~above[self._opposite])
        points, solid = faces.corners[border], self._solid[border]
        counts = np.bincount(solid, minlength=len(some))
        centres = np.stack([np.bincount(solid, x) for x in points[:, :2].T]) / counts[counts > 0]
        away = points[:, :2] - centres.T[np.cumsum(counts > 0)[solid] - 1]
        order = np.lexsort((np.arctan2(away[:, 1], away[:, 0]), solid))
        outlines += np.split(points[order], np.cumsum(counts[counts > 0])[:-1])
        return outlines


def _find_opposite_sides(solids: Sequence[Sequence[Array]]) -> NDArray[np.int64]:
    """Return the index of the same side of the other face, for the side after each corner."""
    opposite: list[int] = []
    for solid in solids:
        first = len(opposite)
        found = {side: first + i for i, side in enumerate(list_sides(solid))}
        opposite += [found[other, one] for one, other in found]
    return np.array(opposite, dtype=np.int64)
