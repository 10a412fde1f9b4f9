"""Sphere."""

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
    """Sphere around its origin, drawn as three circles about x, y and z.

    The circles have `n` points each: 3n vertices and 3n edges. The faces are the three discs, the
    skin is a sphere. The inertia is the inertia of a homogeneous sphere, 2/5 m r^2 about every
    axis.

    Examples
    --------
    >>> len(Ball(0.1, n=16).edges)
    48
    """

    radius: SolidRadius
    n: CirclePoints = 32
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the three discs."""
        n = self.n
        return tuple(tuple(range(start, start + n)) for start in (0, n, 2 * n))

    @property
    def skin(self) -> tuple[Array, tuple[Face, ...]]:
        """Vertices, points of n/2 circles of latitude, and the faces between these points."""
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
