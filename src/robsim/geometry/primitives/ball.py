"""A sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import register
from robsim.geometry.hull import Hull
from robsim.geometry.primitives.primitive import (
    CirclePoints,
    Face,
    FigureColour,
    Primitive,
    SolidRadius,
)
from robsim.geometry.primitives.revolution import (
    circle_points,
    hemisphere_rings,
    revolution_faces,
    revolution_points,
)


@register("shape", "ball")
@dataclass(frozen=True)
class Ball(Primitive):
    """A sphere around its origin, drawn as three circles of `n` points, about x, y and z.

    3n vertices, 3n edges; its faces are the three discs, its skin is round. Its inertia is that of
    the round ball.

    >>> len(Ball(0.1, n=16).edges)
    48
    """

    radius: SolidRadius
    n: CirclePoints = 32
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """The vertex numbers of the three discs."""
        n = self.n
        return tuple(tuple(range(start, start + n)) for start in (0, n, 2 * n))

    @property
    def skin(self) -> tuple[Array, tuple[Face, ...]]:
        """The vertices and the points of n/2 circles of latitude, and the faces between these."""
        radii, heights = hemisphere_rings(self.radius, self.n)
        rings = np.r_[radii[:0:-1], radii], np.r_[-heights[:0:-1], heights]
        round_ = self.pose @ revolution_points(*rings, self.radius, self.n)
        faces = revolution_faces(len(rings[0]), self.n, first=len(self.vertices))
        return np.concatenate([self.vertices, round_]), faces

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        r = self.radius
        x2 = 1 / 5 * r * r
        return 4 / 3 * np.pi * r * r * r, np.zeros(3), (x2, x2, x2)

    def _corners(self) -> Array:
        flat = np.column_stack([circle_points(self.radius, self.n), np.zeros(self.n)])
        return np.concatenate([np.roll(flat, shift, axis=1) for shift in (1, 2, 0)])

    def _hull(self) -> Hull:
        return Hull(np.zeros((1, 3)), np.eye(3), np.empty((0, 3)), beyond=self.radius)
