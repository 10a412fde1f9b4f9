"""Tests whether solids are convex and closed, and the areas of their faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.plot.polygons import list_following

MOST_FACES = 480  # of a solid that is tested
CLOSE = 1e-7  # distance of a corner in a plane, as a share of the size of the scene


def find_convex_solids(solids: Sequence[Sequence[Array]]) -> list[bool]:
    """Return whether each solid is convex and closed, with normals that point outside.

    `solids` are the faces of each solid, each face (n, 3), with its corners counterclockwise as
    seen from outside.
    """
    faces = [face for solid in solids for face in solid]
    near = measure_tolerance(faces)
    return [_is_convex(solid, near) for solid in solids]


def measure_tolerance(faces: Sequence[Array]) -> float:
    """Return the largest distance of a corner in a plane from it."""
    return CLOSE * (float(np.ptp(np.concatenate(faces), axis=0).max()) if faces else 1.0)


def _is_convex(solid: Sequence[Array], near: float) -> bool:
    """Return whether a solid is convex and closed, with normals that point outside."""
    if len(solid) > MOST_FACES:
        return False
    normals = compute_area_vectors(solid)
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


def compute_area_vectors(faces: Sequence[Array]) -> Array:
    """Return the normal of each face (n, 3), as long as twice its area (Newell)."""
    if not faces:
        return np.zeros((0, 3))
    counts = np.array([len(face) for face in faces])
    starts = np.cumsum(counts) - counts
    points = np.concatenate(faces)
    first = np.repeat(points[starts], counts, axis=0)
    pieces = np.cross(points - first, points[list_following(starts, counts)] - first)
    return np.asarray(np.add.reduceat(pieces, starts, axis=0))
