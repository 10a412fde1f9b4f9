"""Cylinder with hemispherical ends."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import register
from robsim.geometry.hull import Hull
from robsim.geometry.pose import Pose
from robsim.geometry.primitives.ball import Ball
from robsim.geometry.primitives.primitive import (
    CirclePoints,
    Face,
    FigureColour,
    Primitive,
    SideLength,
    SolidRadius,
)
from robsim.geometry.primitives.revolution import (
    hemisphere_rings,
    revolution_faces,
    revolution_points,
)
from robsim.geometry.primitives.wheel import Wheel


@register("shape", "capsule")
@dataclass(frozen=True)
class Capsule(Primitive):
    """Cylinder about z with a hemisphere at each end: all points within `radius` of a segment.

    The length is the length of the cylinder, so the whole capsule is `length + 2 radius` long. The
    origin is in the middle. The vertices are circles of n points; the edges are the two circles at
    the ends of the cylinder and two outlines. The inertia is the inertia of the round solid. MuJoCo
    has capsules; `Robot.to_urdf` writes a cylinder and two spheres, because URDF has none.

    Examples
    --------
    >>> float(np.ptp(Capsule(0.1, 0.3).vertices, axis=0)[2])
    0.5
    """

    radius: SolidRadius
    length: SideLength
    n: CirclePoints = 32
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the faces between the circles, then of the faces around the poles."""
        return revolution_faces(2 * self._rings, self.n)

    def simpler(self) -> tuple[Primitive, ...]:
        """Return a wheel and two balls."""
        ends = (self.pose @ Pose.at(0, 0, side * self.length / 2) for side in (-1, 1))
        balls = (Ball(self.radius, self.n, self.color, pose=end) for end in ends)
        return Wheel(self.radius, self.length, self.n, self.color, pose=self.pose), *balls

    @property
    def _rings(self) -> int:
        """Number of circles of one hemisphere."""
        return len(hemisphere_rings(self.radius, self.n)[0])

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        """Return volume, centre and mean squares.

        The mean squares are the means over cylinder and ball, weighted by volume. The centre of
        mass of a hemisphere is 3/8 r from its disc.
        """
        r, h = self.radius, self.length
        tube, ball = np.pi * r * r * h, 4 / 3 * np.pi * r * r * r
        share = ball / (tube + ball)
        x2 = (1 - share) * r * r / 4 + share * r * r / 5
        z2 = (1 - share) * h * h / 12 + share * (r * r / 5 + 3 / 8 * r * h + h * h / 4)
        return tube + ball, np.zeros(3), (x2, x2, z2)

    def _corners(self) -> Array:
        radii, heights = hemisphere_rings(self.radius, self.n)
        up = self.length / 2 + heights
        rings = np.r_[radii[::-1], radii], np.r_[-up[::-1], up]
        return revolution_points(*rings, self.length / 2 + self.radius, self.n)

    def _edges(self) -> list[tuple[int, int]]:
        """Return the circles at both ends of the cylinder, and two outlines from pole to pole."""
        n, rings = self.n, self._rings
        poles = 2 * rings * n, 2 * rings * n + 1
        around = [(i + k * n, (i + 1) % n + k * n) for k in (rings - 1, rings) for i in range(n)]
        for start in (0, n // 4, n // 2, 3 * n // 4):
            line = [poles[0], *(start + k * n for k in range(2 * rings)), poles[1]]
            around += pairwise(line)
        return around

    def _hull(self) -> Hull:
        """Return the segment, with the radius as `beyond`."""
        z = np.array([0.0, 0.0, 1.0])
        core = self.length / 2 * z
        return Hull(np.stack([-core, core]), np.eye(3), z[None], self.radius, core)
