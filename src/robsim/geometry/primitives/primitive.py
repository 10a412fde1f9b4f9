"""The base class of solids: pose, inertia, vertices, edges, faces and hull.

All that figures, files of simulators and distances need of a solid is asked of it here, so that a
new one is a file of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Self

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.declare import Integer, Length, Quantity, Role, check_fields, family
from robsim.declare.texts import Color
from robsim.geometry.hull import Hull
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose, check_single_pose
from robsim.geometry.pose_table import FLAT_POSE

Face = tuple[int, ...]
SHAPES = family("shape")
SideLength = Annotated[float, Length(above=0), "Size along one axis."]
SolidRadius = Annotated[float, Length(above=0), "Radius of the solid."]
CirclePoints = Annotated[int, Integer(3, 4096), "Number of points that draw a circle."]
FigureColour = Annotated[str, Color, Role.LABEL, "Colour in figures."]


@dataclass(frozen=True)
class Primitive:
    """A wire-frame solid at a `pose`; a subclass adds its shape.

    It weighs nothing unless its `mass` (kg) is given, or its `density` (kg/m^3): it is solid then,
    and the same all through.
    """

    pose: Annotated[Pose, FLAT_POSE, "Pose of the solid in the frame that carries it."] = field(
        default=IDENTITY, kw_only=True
    )
    mass: Annotated[
        float | None,
        Quantity(above=0, dimension="mass"),
        Role.FILE,
        "Mass of the solid; None: none, or from its density.",
    ] = field(default=None, kw_only=True)
    density: Annotated[
        float | None,
        Quantity(above=0, dimension="density"),
        Role.FILE,
        "Density of the solid, instead of its mass.",
    ] = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.mass is not None and self.density is not None:
            raise InputError(f"{type(self).__name__}: give its mass or its density, not both")

    def at(self, pose: Any) -> Self:
        """Return a copy that is moved rigidly by `pose`: each vertex p becomes pose @ p.

        >>> from robsim import Block
        >>> float(Block(2, 2, 2).at(Pose.at(1, 0, 0)).vertices[:, 0].max())
        2.0
        """
        moved = check_single_pose(pose, "pose to move a primitive by")
        return replace(self, pose=moved @ self.pose)

    @property
    def inertia(self) -> Inertia | None:
        """The inertia of the solid in the frame of its `pose`, or None if it has no mass.

        >>> from robsim import Block
        >>> Block(2, 1, 1, mass=12).inertia.tensor.diagonal()
        array([2., 5., 5.])
        """
        if self.mass is None and self.density is None:
            return None
        volume, centre, (x2, y2, z2) = self._solid()
        mass = self.mass or volume * (self.density or 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused
            tensor = np.diag(mass * np.array([y2 + z2, x2 + z2, x2 + y2]))
        return Inertia(mass, centre, tensor).at(self.pose)

    @cached_property
    def vertices(self) -> Array:
        """The corner points (V, 3), in metres."""
        return make_read_only(self.pose @ self._corners())

    @property
    def edges(self) -> Array:
        """The edges (E, 2), as pairs of vertex numbers."""
        return np.array(sorted({tuple(sorted(e)) for e in self._edges()}))

    @property
    def color(self) -> str:
        """The colour of the lines: a letter as in the chapter, or any colour of Matplotlib."""
        raise NotImplementedError

    @property
    def faces(self) -> tuple[Face, ...]:
        """The vertex numbers around each face."""
        raise NotImplementedError

    @property
    def skin(self) -> tuple[Array, tuple[Face, ...]]:
        """The points (P, 3) and faces that solid drawings show; the vertices are the first points.

        By default there are no others. What is drawn by a few lines has more.
        """
        return self.vertices, self.faces

    @property
    def hull(self) -> Hull:
        """The convex hull in the axes of the frame that carries it, or a little more than that.

        InputError: none is known.

        >>> from robsim import Block
        >>> [len(part) for part in Block(1, 2, 3).hull[:3]]
        [8, 3, 3]
        """
        return self._hull().at(self.pose)

    def shown(self) -> tuple[Primitive, ...]:
        """Return what figures draw of it: itself, or of a file what that holds."""
        return (self,)

    def simpler(self) -> tuple[Primitive, ...]:
        """Return solids in its place for a file that does not know its kind; by default none."""
        return ()

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        """Return volume, centre of mass, and the mean squares of x, y and z about it."""
        raise NotImplementedError

    def _corners(self) -> Array:
        raise NotImplementedError

    def _hull(self) -> Hull:
        """Return the hull in its own axes."""
        raise InputError(f"no hull of a {type(self).__name__} is known")

    def _edges(self) -> list[tuple[int, int]]:
        """Return the edges: by default every side of every face."""
        return [(a, b) for f in self.faces for a, b in zip(f, f[1:] + f[:1], strict=True)]
