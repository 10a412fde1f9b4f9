"""The convex hull of a solid, with the directions along which it can be apart from another."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose


class Hull(NamedTuple):
    """A convex polytope, and all within `beyond` metres of it; lengths in metres.

    Parallel faces and parallel edges are listed once. `core` is half of the segment through the
    centre that the hull of something long and round is, and zero for others.
    """

    points: Array  # (V, 3)
    normals: Array  # (F, 3) of its faces; of any length, and unit once moved
    edges: Array  # (E, 3) along its edges, likewise
    beyond: float = 0.0  # from the polytope to the surface: the radius of a ball
    core: Array = np.zeros(3)  # (3,)

    @property
    def centre(self) -> Array:
        """The middle (3,) of the box around its points."""
        centre: Array = 0.5 * (self.points.min(axis=0) + self.points.max(axis=0))
        return centre

    @property
    def radius(self) -> float:
        """The radius of a ball around the centre that holds it."""
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
    units: Array = vectors / np.sqrt((vectors * vectors).sum(axis=-1))[:, None]
    return units
