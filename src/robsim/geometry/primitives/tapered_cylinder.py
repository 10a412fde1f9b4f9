"""Cylinder with a radius that changes along its axis."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Length, register
from robsim.geometry.hull import Hull
from robsim.geometry.pose import Pose
from robsim.geometry.primitives.primitive import (
    CirclePoints,
    Face,
    FigureColour,
    Primitive,
    SideLength,
    SolidRadius,
)
from robsim.geometry.primitives.revolution import circle_points, unit_circle_points
from robsim.geometry.primitives.wheel import Wheel

EXPORT_SLICES = 4  # number of cylinders that replace the solid in files of simulators


@register("shape", "tapered_cylinder")
@dataclass(frozen=True)
class TaperedCylinder(Primitive):
    """Truncated cone about z, from `radius` at its lower end to `end_radius` at its upper end.

    The origin is midway between the ends. There are 2n vertices, 2n + 4 edges (two circles and four
    lines between them) and n + 2 faces. The inertia is the inertia of the round solid. URDF and
    MJCF lack this shape: exported files contain four cylinders with the volumes of four slices.

    Examples
    --------
    >>> float(np.ptp(TaperedCylinder(0.1, 0.05, 0.3).vertices, axis=0)[2])
    0.3
    """

    radius: SolidRadius
    end_radius: Annotated[float, Length(above=0), "Radius at the upper end."]
    length: SideLength
    n: CirclePoints = 32
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the tread, then of the two discs."""
        return self._tube.faces

    def simpler(self) -> tuple[Primitive, ...]:
        """Return four wheels, each with the volume of its slice."""
        edges = np.linspace(self.radius, self.end_radius, EXPORT_SLICES + 1)
        height = self.length / EXPORT_SLICES
        wheels = []
        for i, (r, s) in enumerate(pairwise(edges)):
            middle = Pose.at(0, 0, (i + 0.5) * height - self.length / 2)
            mean = float(np.sqrt((r * r + r * s + s * s) / 3))
            wheels.append(Wheel(mean, height, self.n, self.color, pose=self.pose @ middle))
        return tuple(wheels)

    @property
    def _tube(self) -> Wheel:
        """Cylinder with the same vertex indices in edges and faces."""
        return Wheel(self.radius, self.length, self.n)

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        """Return volume, centre and mean squares, by integrals over slices across z.

        With the radius s = r + (R - r) t for t in [0, 1] along the axis, the integrals of s^2, s^2
        t, s^2 t^2 and s^4 are (r^2 + r R + R^2)/3, (r^2 + 2 r R + 3 R^2)/12, (r^2 + 3 r R + 6
        R^2)/30 and (r^4 + r^3 R + r^2 R^2 + r R^3 + R^4)/5.
        """
        r, R, h = self.radius, self.end_radius, self.length
        rr, rR, RR = r * r, r * R, R * R
        area = (rr + rR + RR) / 3
        t = (rr + 2 * rR + 3 * RR) / 12 / area
        t2 = (rr + 3 * rR + 6 * RR) / 30 / area
        x2 = (rr * rr + rR * (rr + rR + RR) + RR * RR) / 20 / area
        centre = np.array([0.0, 0.0, h * (t - 0.5)])
        return np.pi * area * h, centre, (x2, x2, h * h * (t2 - t * t))

    def _corners(self) -> Array:
        rings = (circle_points(radius, self.n) for radius in (self.radius, self.end_radius))
        z = np.repeat([-self.length / 2, self.length / 2], self.n)
        return np.column_stack([np.concatenate(list(rings)), z])

    def _edges(self) -> list[tuple[int, int]]:
        n = self.n
        return [*self._tube._edges(), *((i, i + n) for i in (0, n // 4, n // 2, 3 * n // 4))]

    def _hull(self) -> Hull:
        """Return the circumscribed truncated pyramid, whose sides touch the circles."""
        n, h = self.n, self.length
        corner = 2 * np.pi * np.arange(n) / n
        unit, z = unit_circle_points(corner) / np.cos(np.pi / n), np.array([[0.0, 0.0, 1.0]])
        low, high = unit * self.radius - h / 2 * z, unit * self.end_radius + h / 2 * z
        outwards = h * unit_circle_points(corner + np.pi / n) + (self.radius - self.end_radius) * z
        along = unit_circle_points(corner + np.pi / n + np.pi / 2)[: n if n % 2 else n // 2]
        return Hull(
            np.concatenate([low, high]),
            np.concatenate([outwards, z]),
            np.concatenate([along, high - low]),
        )
