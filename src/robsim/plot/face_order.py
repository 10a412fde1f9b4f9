"""Faces of solids in the order of the painter: hidden faces first, and intersecting faces split.

A convex solid divides the other faces: parts behind all its visible faces are painted before it,
and parts in front of one of them after it. A face that is neither is split at the planes of the
solid. Both sets are divided further, until a set is a single convex solid: its visible faces do not
hide each other (Fuchs, Kedem and Naylor 1980, "On visible surface generation by a priori tree
structures").

Faces and parts of them that a single convex solid hides are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.raster import painter_order, piece_cuts
from robsim.plot.convex_solids import (
    CLOSE,
    compute_area_vectors,
    find_convex_solids,
    measure_tolerance,
)
from robsim.plot.polygons import FaceArrays, Indices, expand_ranges

MOST_LONE = 120  # faces of a solid that is not convex and yet is ordered exactly
MOST_COVERING = 100  # faces of a solid that may hide faces: it takes longer for more faces
COVERED = 1e-3  # depth in a solid from which it hides a face, as a share of the size of the scene


class PaintedFaces(NamedTuple):
    """Faces and parts of faces in the order of painting, the farthest first.

    The faces of a group do not hide each other.

    Attributes
    ----------
    corners : array of shape (N, 3)
        Corners of all parts, part by part, in metres.
    is_side : array of bool, shape (N,)
        Whether the line from each corner to the next is a side of the face, not a cut.
    counts : array of int, shape (P,)
        Number of corners of each part.
    sources : array of int, shape (P,)
        Index of the face of each part.
    groups : array of int, shape (P,)
        Index of the group of each part.
    """

    corners: Array
    is_side: NDArray[np.bool_]
    counts: Indices
    sources: Indices
    groups: Indices


class FaceOrder:
    """The faces of solids, ordered anew for each position of the viewer.

    `solids` are the faces of each solid, each face (n, 3), with its corners counterclockwise as
    seen from outside.
    """

    def __init__(self, solids: Sequence[Sequence[Array]]) -> None:
        self.convex = find_convex_solids(solids)
        self._number_bodies([len(solid) for solid in solids])
        self.place(FaceArrays.of([face for solid in solids for face in solid]))

    def place(self, faces: FaceArrays) -> None:
        """Place the faces of the same solids at other poses."""
        self.faces = faces
        normals = compute_area_vectors(faces)
        self._areas = np.linalg.norm(normals, axis=1)
        self._normals = normals / np.maximum(self._areas, 1e-300)[:, None]
        self._offsets = (self._normals * faces.corners[faces.starts]).sum(axis=1)
        self._near = measure_tolerance(faces.corners)
        self._balls = self._find_balls()

    def _number_bodies(self, sizes: Sequence[int]) -> None:
        """Count each face of a small solid that is not convex as a solid, and number all."""
        bodies: list[Indices] = []
        divides: list[bool] = []
        closed: list[bool] = []
        for size, convex in zip(sizes, self.convex, strict=True):
            alone = not convex and size <= MOST_LONE
            bodies.append(len(divides) + np.arange(size) * alone)
            divides += [convex or alone] * (size if alone else 1)
            closed += [convex] * size
        self._bodies = np.concatenate([np.empty(0, np.int64), *bodies])
        self._divides, self._is_closed = np.array(divides, bool), np.array(closed, bool)
        self._first = np.searchsorted(self._bodies, np.arange(len(divides) + 1))

    def arrange(self, viewer: Array) -> PaintedFaces:
        """Return the faces in the order of painting, as seen from a viewer in homogeneous (4,).

        Faces of convex solids that are turned away from the viewer are left out, as are parts that
        a single convex solid hides.
        """
        sides = self._normals @ viewer[:3] - self._offsets * viewer[3]
        towards = np.where(sides < 0, -1.0, 1.0)
        visible = np.flatnonzero(~self._is_closed | (sides > 0))
        planes = (self._normals * towards[:, None], self._offsets * towards, self._areas)
        solids = self._first, self._balls, sides, viewer, COVERED / CLOSE * self._near
        given = *planes, self._bodies, self._near, *solids, self._rank_bodies(viewer)
        room = 8 * len(visible) + 64
        while True:
            pieces = _Pieces.of(self.faces, visible, room)
            if pieces.arrange(given, len(self._divides)):
                return pieces.list_parts(viewer)
            room *= 4

    def _find_balls(self) -> Array:
        """Return centre and radius (bodies, 4) of a ball around each solid that may hide faces.

        The radius is -1 for other solids.
        """
        faces, first = self.faces, self._first[:-1]
        starts, counts = faces.starts[first], np.add.reduceat(faces.counts, first)
        centres = np.add.reduceat(faces.corners, starts, axis=0) / counts[:, None]
        away = faces.corners - np.repeat(centres, counts, axis=0)
        radii = np.sqrt(np.maximum.reduceat((away**2).sum(axis=1), starts))
        hides = self._is_closed[first] & (np.diff(self._first) <= MOST_COVERING)
        return np.column_stack([centres, np.where(hides, radii, -1.0)])

    def _rank_bodies(self, viewer: Array) -> Indices:
        """Return the places of the convex solids in the order of depth, -1 for other solids."""
        faces = self.faces
        centres = np.add.reduceat(faces.corners, faces.starts, axis=0) / faces.counts[:, None]
        totals = np.zeros((len(self._divides), 3))
        np.add.at(totals, self._bodies, centres)
        nearness = _measure_nearness(totals / np.bincount(self._bodies)[:, None], viewer)
        rank = np.full(len(totals), -1)
        convex = np.flatnonzero(self._divides)
        rank[convex[np.argsort(nearness[convex], kind="stable")]] = np.arange(len(convex))
        return rank


class _Pieces(NamedTuple):
    """The working memory of `arrange_faces`."""

    pieces: Indices
    corners: Array
    is_side: NDArray[np.bool_]
    totals: Indices
    lists: Indices
    sets: Indices

    @classmethod
    def of(cls, faces: FaceArrays, visible: Indices, room: int) -> _Pieces:
        """Return the visible faces, with room for a number of parts."""
        n, some = len(visible), faces.counts[visible]
        ends = np.cumsum(some)
        count = int(ends[-1]) if n else 0
        pieces = np.empty((piece_cuts.FACE_ROWS, room), np.int64)
        pieces[:, :n] = ends - some, some, visible
        corners = np.empty((8 * room + 2 * count, 3))
        corners[:count] = faces.corners[expand_ranges(faces.starts[visible], some)]
        totals = np.array([n, count, 0])
        lists = np.empty((painter_order.LIST_ROWS, room), np.int64)
        sets = np.empty((painter_order.SET_ROWS, room), np.int64)
        return cls(pieces, corners, np.ones(len(corners), bool), totals, lists, sets)

    def arrange(self, given: tuple[Any, ...], bodies: int) -> bool:
        """Order the pieces; return whether they have enough room."""
        count = len(given[0])
        longest = int(self.pieces[piece_cuts.COUNT, : self.totals[0]].max(initial=0))
        heights = np.empty((longest + piece_cuts.SPARE, count))
        present, faces = np.empty(bodies, np.int64), np.empty(count, np.int64)
        return bool(painter_order.arrange_faces(*given, *self, present, heights, faces))

    def list_parts(self, viewer: Array) -> PaintedFaces:
        """Return the parts in the order of painting."""
        ends = self.sets[painter_order.GROUP_END, : self.totals[piece_cuts.GROUPS]]
        order = self.lists[painter_order.ORDER, : ends[-1] if len(ends) else 0]
        for k in np.flatnonzero(self.sets[painter_order.IS_SORTED, : len(ends)] == 0):
            span = slice(ends[k - 1] if k else 0, ends[k])
            order[span] = order[span][
                np.argsort(self._measure_nearness(order[span], viewer), kind="stable")
            ]
        first, counts, sources = self.pieces[:, order]
        corners = expand_ranges(first, counts)
        groups = np.repeat(np.arange(len(ends)), np.diff(ends, prepend=0))
        return PaintedFaces(self.corners[corners], self.is_side[corners], counts, sources, groups)

    def _measure_nearness(self, pieces: Indices, viewer: Array) -> Array:
        """Return a number for the centre of each piece that grows towards the viewer."""
        first, counts, _ = self.pieces[:, pieces]
        points = self.corners[expand_ranges(first, counts)]
        totals = np.add.reduceat(points, np.cumsum(counts) - counts, axis=0)
        return _measure_nearness(totals / counts[:, None], viewer)


def _measure_nearness(points: Array, viewer: Array) -> Array:
    """Return a number for each point (n, 3) that grows towards the viewer."""
    if viewer[3]:
        return np.asarray(-np.linalg.norm(points - viewer[:3], axis=1))
    return np.asarray(points @ viewer[:3])


def find_viewer(projection: Array) -> Array:
    """Return the viewer (4,) of a projection (4, 4), as a point in homogeneous coordinates.

    The last coordinate is 1, or 0 if the viewer is infinitely far away. Depths of the projection
    grow away from the viewer.
    """
    viewer = np.linalg.svd(projection[[0, 1, 3]])[2][-1]
    if abs(viewer[3]) > 1e-9:
        return np.asarray(viewer / viewer[3])
    viewer[3] = 0.0
    return np.asarray(viewer if projection[2] @ viewer < 0 else -viewer)
