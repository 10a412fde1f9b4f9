"""Surface of triangles, the content of a mesh file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.base.arrays import Array, make_read_only
from robsim.geometry.mesh_parser import Indices
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive


@dataclass(frozen=True, eq=False)
class Surface(Primitive):
    """Triangles of one colour, for figures only.

    A surface has no inertia, no hull and no text form.

    Parameters
    ----------
    points : ndarray of shape (P, 3)
        Corners of the triangles, in metres.
    triangles : ndarray of shape (F, 3)
        Indices of the points of each triangle.
    sharp : ndarray of shape (E, 2)
        Indices of the points of each sharp edge.
    color : str, default "k"
        Colour in figures.

    Examples
    --------
    >>> corner = Surface(np.eye(3), np.array([[0, 1, 2]]), np.array([[0, 1]]))
    >>> corner.faces, len(corner.edges)
    (((0, 1, 2),), 1)
    """

    points: Annotated[Array, "Corners of the triangles."]
    triangles: Annotated[Indices, "Indices (F, 3) of the points of each triangle."]
    sharp: Annotated[Indices, "Sharp edges (E, 2), as indices of points."]
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Point indices of each triangle."""
        return tuple(map(tuple, self.triangles.tolist()))

    @property
    def edges(self) -> Indices:
        """Edges (E, 2) along bends and ends of the surface, as indices of points."""
        return self.sharp

    def _corners(self) -> Array:
        return make_read_only(self.points)
