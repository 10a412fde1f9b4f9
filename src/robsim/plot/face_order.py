"""Faces of solids in the order of the painter: hidden faces first, and intersecting faces split.

A convex solid divides the other faces: parts behind all its visible faces are painted before it,
and parts in front of one of them after it. A face that is neither is split at the planes of the
solid. Both sets are divided further, until a set is a single convex solid: its visible faces do not
hide each other (Fuchs, Kedem and Naylor 1980, "On visible surface generation by a priori tree
structures").
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robsim.base.arrays import Array

MOST_LONE = 120  # faces of a solid that is not convex and yet is ordered exactly
CLOSE = 1e-7  # distance of a corner in a plane, as a share of the size of the scene


class PaintedFace(NamedTuple):
    """A face, or a part of it, to be painted.

    Attributes
    ----------
    source : int
        Index of the face.
    corners : array of shape (n, 3)
        Corners in metres.
    is_side : tuple of bool
        Whether the line from each corner to the next is a side of the face, not a cut.
    body : int
        Number of the solid.
    """

    source: int
    corners: Array
    is_side: tuple[bool, ...]
    body: int


class _Outline(NamedTuple):
    """The outline of a part: corners, and whether a side of the face follows each of them."""

    corners: list[list[float]]
    is_side: list[bool]

    def append(self, corner: list[float], is_side: bool) -> None:
        """Append a corner."""
        self.corners.append(corner)
        self.is_side.append(is_side)


class FaceOrder:
    """The faces of solids, ordered anew for each position of the viewer.

    `solids` are the faces of each solid, each face (n, 3), with its corners counterclockwise as
    seen from outside. `like` is the order of the same solids at other poses.
    """

    def __init__(self, solids: Sequence[Sequence[Array]], like: FaceOrder | None = None) -> None:
        faces = [face for solid in solids for face in solid]
        self._normals = _compute_area_vectors(faces)
        self._areas = np.linalg.norm(self._normals, axis=1)
        self._normals = self._normals / np.maximum(self._areas, 1e-300)[:, None]
        counts = np.array([len(face) for face in faces], dtype=np.int64)
        starts = np.cumsum(counts) - counts
        points = np.concatenate([np.zeros((0, 3)), *faces])
        self._offsets = (self._normals * points[starts]).sum(axis=1)
        self._face_centres = np.empty((len(faces), 3))
        for n in np.unique(counts):  # faces with equal numbers of corners at once
            some = np.flatnonzero(counts == n)
            corners = points[starts[some, None] + np.arange(n)]
            self._face_centres[some] = corners.mean(axis=1)
        self._sides = {n: (True,) * n for n in set(counts.tolist())}
        self._near = CLOSE * (float(np.ptp(points, axis=0).max()) if len(points) else 1.0)
        self._pieces: list[PaintedFace] = []
        self._is_convex: list[bool | None] = []  # of each solid; None for a lone face
        self._centres: list[Array] = []  # of each solid
        ends = np.cumsum([len(solid) for solid in solids])[:-1]
        normals = np.split(self._normals, ends)
        self.convex: list[bool] = (
            like.convex if like else list(map(self._check_convex, solids, normals))
        )
        for solid, convex in zip(solids, self.convex, strict=True):
            self._add_solid(solid, convex)

    def _add_solid(self, solid: Sequence[Array], convex: bool) -> None:
        """Add a solid; the faces of a small solid that is not convex count as solids."""
        first = len(self._pieces)
        alone = not convex and len(solid) <= MOST_LONE
        for i, face in enumerate(solid):
            body = len(self._is_convex) + (i if alone else 0)
            self._pieces.append(PaintedFace(first + i, face, self._sides[len(face)], body))
        centres = self._face_centres[first : first + len(solid)]
        self._centres += list(centres) if alone else [centres.mean(axis=0)]
        self._is_convex += [None] * len(solid) if alone else [convex]

    def _check_convex(self, solid: Sequence[Array], normals: Array) -> bool:
        """Return whether a solid is convex and closed, with normals that point outside."""
        if len(solid) > 4 * MOST_LONE:
            return False
        offsets = (np.array([face[0] for face in solid]) * normals).sum(axis=1)
        if (np.concatenate(solid) @ normals.T - offsets).max() > self._near:
            return False
        sides: set[tuple[bytes, bytes]] = set()
        for face in solid:
            corners = [corner.tobytes() for corner in face]
            sides.update(zip(corners, corners[1:] + corners[:1], strict=True))
        return all((other, one) in sides for one, other in sides)

    def arrange(self, viewer: Array) -> list[list[PaintedFace]]:
        """Return groups of faces, the farthest first, as seen from a viewer in homogeneous (4,).

        The faces of a group do not hide each other. Faces of convex solids that are turned away
        from the viewer are left out.
        """
        sides = self._normals @ viewer[:3] - self._offsets * viewer[3]
        towards = np.where(sides < 0, -1.0, 1.0)
        planes = self._normals * towards[:, None], self._offsets * towards
        visible = [p for p in self._pieces if not self._is_convex[p.body] or sides[p.source] > 0]
        groups: list[list[PaintedFace]] = []
        pending = [visible]
        while pending:
            pieces = pending.pop()
            body = self._choose_body(pieces, viewer)
            own = [piece for piece in pieces if piece.body == body]
            if len(own) == len(pieces):
                groups.append(own)
            elif body is None:
                centres = [piece.corners.mean(axis=0) for piece in pieces]
                order = np.argsort(_measure_nearness(centres, viewer), kind="stable")
                groups.append([pieces[i] for i in order])
            else:
                others = [piece for piece in pieces if piece.body != body]
                near, far = self._separate(others, planes, own)
                pending += [near, own, far]
        return [group for group in groups if group]

    def _choose_body(self, pieces: list[PaintedFace], viewer: Array) -> int | None:
        """Return the convex solid of median depth, or None without a convex solid."""
        bodies = sorted({p.body for p in pieces if self._is_convex[p.body] is not False})
        if not bodies:
            return None
        order = np.argsort(_measure_nearness([self._centres[i] for i in bodies], viewer))
        return bodies[int(order[len(order) // 2])]

    def _separate(
        self, pieces: list[PaintedFace], planes: tuple[Array, Array], body: list[PaintedFace]
    ) -> tuple[list[PaintedFace], list[PaintedFace]]:
        """Return the parts of pieces in front of a visible face of a body, and the other parts.

        The body hides no part in front of one of its faces, and no part behind all faces hides the
        body or a part in front. A piece in the plane of a larger face counts as in front of it.
        """
        faces = list({piece.source: None for piece in body})
        normals, offsets = planes[0][faces], planes[1][faces]
        points = np.concatenate([piece.corners for piece in pieces])
        starts = np.cumsum([0, *(len(piece.corners) for piece in pieces[:-1])])
        heights = points @ normals.T - offsets
        low = np.minimum.reduceat(heights, starts, axis=0)
        high = np.maximum.reduceat(heights, starts, axis=0)
        own = self._areas[[piece.source for piece in pieces]]
        flat = (np.abs(low) <= self._near) & (np.abs(high) <= self._near)
        smaller = flat & (own[:, None] < self._areas[faces])
        in_front = (((low >= -self._near) & (high > self._near)) | smaller).any(axis=1)
        behind = (high <= self._near).all(axis=1) & ~in_front
        near = [pieces[i] for i in np.flatnonzero(in_front)]
        far = [pieces[i] for i in np.flatnonzero(behind)]
        for i in np.flatnonzero(~in_front & ~behind):
            own_heights = heights[starts[i] : starts[i] + len(pieces[i].corners)]
            outside, inside = self._carve(pieces[i], own_heights, normals, offsets)
            near += outside
            far += inside
        return near, far

    def _carve(
        self, piece: PaintedFace, heights: Array, normals: Array, offsets: Array
    ) -> tuple[list[PaintedFace], list[PaintedFace]]:
        """Return the parts of a piece in front of any plane, and the part behind all planes.

        `heights` are the heights of the corners over the planes.
        """
        outside: list[PaintedFace] = []
        while True:
            high = heights.max(axis=0)
            best = int(high.argmax())
            if high[best] <= self._near:
                return outside, [piece]
            levels = heights[:, best].tolist()
            if min(levels) >= -self._near:
                return [*outside, piece], []
            above, piece = _cut_piece(piece, levels)
            outside.append(above)
            heights = piece.corners @ normals.T - offsets


def _measure_nearness(points: Sequence[Array], viewer: Array) -> Array:
    """Return a number for each point (3,) that grows towards the viewer."""
    centres = np.array(points)
    if viewer[3]:
        return np.asarray(-np.linalg.norm(centres - viewer[:3], axis=1))
    return np.asarray(centres @ viewer[:3])


def _cut_piece(piece: PaintedFace, levels: list[float]) -> tuple[PaintedFace, PaintedFace]:
    """Return the parts of a convex piece above and below a plane that crosses it.

    `levels` are the heights of the corners over the plane.
    """
    above, below = _Outline([], []), _Outline([], [])
    corners = piece.corners.tolist()
    following = zip(corners[1:] + corners[:1], levels[1:] + levels[:1], strict=True)
    for corner, level, is_side, (end, then) in zip(
        corners, levels, piece.is_side, following, strict=True
    ):
        if level >= 0:
            above.append(corner, is_side and (level > 0 or then > 0))
        if level <= 0:
            below.append(corner, is_side and (level < 0 or then < 0))
        if level * then < 0:
            share = level / (level - then)
            (x, y, z), (a, b, c) = corner, end
            cut = [x + share * (a - x), y + share * (b - y), z + share * (c - z)]
            above.append(cut, is_side and then > 0)
            below.append(cut, is_side and then < 0)
    source, body = piece.source, piece.body
    return (
        PaintedFace(source, np.array(above.corners), tuple(above.is_side), body),
        PaintedFace(source, np.array(below.corners), tuple(below.is_side), body),
    )


def _compute_area_vectors(faces: Sequence[Array]) -> Array:
    """Return the normal of each face (n, 3), as long as twice its area (Newell)."""
    if not faces:
        return np.zeros((0, 3))
    counts = np.array([len(face) for face in faces])
    starts = np.cumsum(counts) - counts
    points = np.concatenate(faces)
    following = np.arange(1, len(points) + 1)
    following[starts + counts - 1] = starts
    first = np.repeat(points[starts], counts, axis=0)
    pieces = np.cross(points - first, points[following] - first)
    return np.asarray(np.add.reduceat(pieces, starts, axis=0))


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
