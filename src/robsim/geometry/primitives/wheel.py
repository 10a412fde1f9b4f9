"""Wheel, drawn as a flat cylinder."""

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
    SideLength,
    SolidRadius,
)
from robsim.geometry.primitives.revolution import circle_points, unit_circle_points


@register("shape", "wheel")
@dataclass(frozen=True)
class Wheel(Primitive):
    """Cylinder about z, drawn by two circles; x points to the angle 0 of the circles.

    The origin is midway between the centres. There are 2n vertices, 2n edges (two circles) and n +
    2 faces for solid drawing (chapter, section 2.2). The inertia is the inertia of the round
    cylinder, not of the drawn prism.

    Examples
    --------
    >>> len(Wheel(0.1, 0.02, n=16).edges)
    32
    """

    radius: SolidRadius
    width: SideLength
    n: CirclePoints = 32
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the tread, then of the two discs."""
        n = self.n
        tread = tuple((i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n))
        return (*tread, tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)))

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        r, h = self.radius, self.width
        return np.pi * r * r * h, np.zeros(3), (r * r / 4, r * r / 4, h * h / 12)

    def _corners(self) -> Array:
        z = np.repeat([-self.width / 2, self.width / 2], self.n)
        return np.column_stack([np.tile(circle_points(self.radius, self.n), (2, 1)), z])

    def _edges(self) -> list[tuple[int, int]]:
        n = self.n
        return [(i + ring, (i + 1) % n + ring) for ring in (0, n) for i in range(n)]

    def _hull(self) -> Hull:
        """Return the prism around the circle.

        Its sides touch the circle at their middles, so the corners are R/cos(pi/n) from the axis.
        """
        n, z = self.n, [[0.0, 0.0, 1.0]]
        corner = 2 * np.pi * np.arange(n) / n
        side = (corner + np.pi / n)[: n if n % 2 else n // 2]  # for even n, two sides are parallel
        ring = unit_circle_points(corner) * self.radius / np.cos(np.pi / n)
        ends = [ring + np.array([0.0, 0.0, end * self.width / 2]) for end in (-1, 1)]
        normals, along = unit_circle_points(side), unit_circle_points(side + np.pi / 2)
        return Hull(np.concatenate(ends), np.concatenate([normals, z]), np.concatenate([along, z]))
