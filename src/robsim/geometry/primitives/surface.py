"""A surface of triangles, as a mesh file holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from robsim.base.arrays import Array, make_read_only
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive


@dataclass(frozen=True, eq=False)
class Surface(Primitive):
    """Triangles (F, 3), numbers of `points` (P, 3) in metres, drawn in a colour.

    It is drawn and no more: it has no inertia, no hull and no text.

    >>> corner = Surface(np.eye(3), np.array([[0, 1, 2]]), np.array([[0, 1]]))
    >>> corner.faces, len(corner.edges)
    (((0, 1, 2),), 1)
    """

    points: Annotated[Any, "Corners of the triangles."]
    triangles: Annotated[Any, "Numbers of the points at their corners."]
    sharp: Annotated[Any, "Edges (E, 2) where it bends, as numbers of points."]
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """The point numbers of each triangle."""
        return tuple(map(tuple, self.triangles.tolist()))

    @property
    def edges(self) -> Array:
        """The edges (E, 2) where the surface bends or ends."""
        edges: Array = self.sharp
        return edges

    def _corners(self) -> Array:
        return make_read_only(self.points)
