"""Convex hull of a solid, with the normals and edge directions of the separating-axis test."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose


class Hull(NamedTuple):
    """Convex polytope, or all points within the distance `beyond` of a polytope.

    Parallel faces and parallel edges are listed once.

    Attributes
    ----------
    points : ndarray of shape (V, 3)
        Corners of the polytope, in metres.
    normals : ndarray of shape (F, 3)
        Normals of the faces, of any length. `at` makes them unit vectors.
    edges : ndarray of shape (E, 3)
        Directions of the edges, of any length. `at` makes them unit vectors.
    beyond : float, default 0
        Distance from the polytope to the surface, in metres: the radius of a ball.
    core : ndarray of shape (3,)
        Half of the axis of a long round hull such as a capsule, from the centre, in metres. Zero
        for other hulls.
    """

    points: Array
    normals: Array
    edges: Array
    beyond: float = 0.0
    core: Array = np.zeros(3)

    @property
    def centre(self) -> Array:
        """Centre (3,) of the bounding box of the points, in metres."""
        centre: Array = 0.5 * (self.points.min(axis=0) + self.points.max(axis=0))
        return centre

    @property
    def radius(self) -> float:
        """Radius of a ball around the centre that contains the hull, in metres."""
        return float(np.sqrt(((self.points - self.centre) ** 2).sum(axis=-1)).max()) + self.beyond

    def at(self, pose: Pose) -> Self:
        """Return a copy that is moved rigidly by `pose`."""
        R = pose.rotation
        normals, edges = (
            _normalize_vectors(self.normals @ R.T),
            _normalize_vectors(self.edges @ R.T),
        )
        return self._replace(
            points=pose @ self.points, normals=normals, edges=edges, core=R @ self.core
        )


def _normalize_vectors(vectors: Array) -> Array:
    """Return the vectors (N, 3) divided by their lengths."""
    units: Array = vectors / np.sqrt((vectors * vectors).sum(axis=-1))[:, None]
    return units
