"""Box."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import register
from robsim.geometry.hull import Hull
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive, SideLength

# a rectangular tube between two rings of four corners, 0-3 and 4-7
RING_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
TUBE_SIDES: tuple[Face, ...] = tuple((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4))


@register("shape", "block")
@dataclass(frozen=True)
class Block(Primitive):
    """Box, centred at the origin: x along its length, y along its width, z along its height.

    The block has 8 vertices, 12 edges and 6 faces (chapter, section 2.1).

    Examples
    --------
    >>> block = Block(0.3, 0.2, 0.1, color="r")
    >>> block.vertices.max(axis=0), len(block.edges), len(block.faces)
    (array([0.15, 0.1 , 0.05]), 12, 6)
    """

    length: SideLength
    width: SideLength
    height: SideLength
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the bottom, the top and the four sides."""
        return ((3, 2, 1, 0), (4, 5, 6, 7), *TUBE_SIDES)

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        a, b, c = self.length, self.width, self.height
        return a * b * c, np.zeros(3), (a * a / 12, b * b / 12, c * c / 12)

    def _corners(self) -> Array:
        half = np.array([self.length, self.width, self.height]) / 2
        return half * [(x, y, z) for z, (x, y) in product((-1, 1), RING_CORNERS)]

    def _hull(self) -> Hull:
        return Hull(self._corners(), np.eye(3), np.eye(3))
