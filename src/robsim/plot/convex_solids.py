"""Tests whether solids are convex and closed, and the areas of their faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.plot.polygons import FaceArrays, join_faces

MOST_FACES = 480  # of a solid that is tested
CLOSE = 1e-7  # distance of a corner in a plane, as a share of the size of the scene


def find_convex_solids(solids: Sequence[Sequence[Array]]) -> list[bool]:
    """Return whether each solid is convex and closed, with normals that point outside.

    `solids` are the faces of each solid, each face (n, 3), with its corners counterclockwise as
    seen from outside.
    """
    faces = [face for solid in solids for face in solid]
    near = measure_tolerance(join_faces(faces))
    return [_is_convex(solid, near) for solid in solids]


def measure_tolerance(corners: Array) -> float:
    """Return the largest distance of a corner (N, 3) in a plane from it."""
    if not len(corners):
        return CLOSE
    columns = np.ascontiguousarray(corners.T)  # extremes of rows are found faster
    return CLOSE * float((columns.max(axis=1) - columns.min(axis=1)).max())


def _is_convex(solid: Sequence[Array], near: float) -> bool:
    """Return whether a solid is convex and closed, with normals that point outside."""
    if len(solid) > MOST_FACES:
        return False
    normals = compute_area_vectors(FaceArrays.of(solid))
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    offsets = (np.array([face[0] for face in solid]) * normals).sum(axis=1)
    if (np.concatenate(solid) @ normals.T - offsets).max() > near:
        return False
    sides = list_sides(solid)
    known = set(sides)
    return len(known) == len(sides) and all((other, one) in known for one, other in sides)


def list_sides(faces: Sequence[Array]) -> list[tuple[bytes, bytes]]:
    """Return the bytes of both ends of each side, face by face."""
    corners = [[corner.tobytes() for corner in face] for face in faces]
    return [side for each in corners for side in zip(each, each[1:] + each[:1], strict=True)]


def compute_area_vectors(faces: FaceArrays) -> Array:
    """Return the normal of each face, as long as twice its area (Newell)."""
    if not len(faces.counts):
        return np.zeros((0, 3))
    points = faces.corners
    away = points - np.repeat(points[faces.starts], faces.counts, axis=0)
    return np.asarray(np.add.reduceat(np.cross(away, away[faces.following]), faces.starts, axis=0))
