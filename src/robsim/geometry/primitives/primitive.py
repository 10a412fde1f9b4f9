"""Base class of solids: pose, inertia, vertices, edges, faces and hull.

Figures, exporters and distance computations use this interface only, so a new solid needs no
change elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Self

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.declare import Integer, Length, Number, Quantity, Role, check_fields, family
from robsim.declare.texts import Color
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.hull import Hull
from robsim.geometry.inertia import Inertia
from robsim.geometry.mesh_parser import Indices
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose
from robsim.geometry.pose_table import FLAT_POSE

Face = tuple[int, ...]
SHAPES = family("shape")
SideLength = Annotated[float, Length(above=0), "Size along one axis."]
SolidRadius = Annotated[float, Length(above=0), "Radius of the solid."]
CirclePoints = Annotated[int, Integer(3, 4096), "Number of points of a drawn circle."]
FigureColour = Annotated[str, Color, Role.LABEL, "Colour in figures."]


@dataclass(frozen=True)
class Primitive:
    """Base class of wire-frame solids at a pose; a subclass defines the shape.

    A solid with a mass or a density is a homogeneous body. Without either it is massless.

    Parameters
    ----------
    pose : Pose, default the identity
        Pose of the solid in the frame that carries it.
    mass : float, optional
        Mass in kg.
    density : float, optional
        Density in kg/m^3, in place of the mass.
    albedo : float, default 0.6
        Share of the light that the surface reflects in pictures, from 0 to 1.

    Raises
    ------
    InputError
        If both mass and density are given.

    Examples
    --------
    >>> from robsim.shapes import Ball
    >>> isinstance(Ball(0.1), Primitive), Ball(0.1).inertia
    (True, None)
    """

    pose: Annotated[Pose, FLAT_POSE, "Pose of the solid in the frame that carries it."] = field(
        default=IDENTITY, kw_only=True
    )
    mass: Annotated[
        float | None,
        Quantity(above=0, dimension="mass"),
        "Mass of the solid. None: no mass, or the mass that follows from the density.",
    ] = field(default=None, kw_only=True)
    density: Annotated[
        float | None,
        Quantity(above=0, dimension="density"),
        "Density of the solid, in place of its mass.",
    ] = field(default=None, kw_only=True)
    albedo: Annotated[
        float,
        Number(least=0, most=1),
        Role.FIGURE,
        "Share of the light that the surface reflects in pictures.",
    ] = field(default=0.6, kw_only=True)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.mass is not None and self.density is not None:
            raise InputError(f"{type(self).__name__}: give its mass or its density, not both")

    def at(self, pose: PoseLike) -> Self:
        """Return a copy that is moved rigidly by `pose`: each vertex p becomes pose @ p.

        Parameters
        ----------
        pose : Pose or array_like of shape (4, 4)
            Pose of the present frame of the solid in the new frame.

        Returns
        -------
        Primitive
            Solid of the same type.

        Examples
        --------
        >>> from robsim import Block
        >>> float(Block(2, 2, 2).at(Pose.at(1, 0, 0)).vertices[:, 0].max())
        2.0
        """
        transform = check_single_pose(pose, "pose to move a primitive by")
        return replace(self, pose=transform @ self.pose)

    @property
    def inertia(self) -> Inertia | None:
        """Inertia in the frame that carries the solid, or None if the solid is massless.

        Examples
        --------
        >>> from robsim import Block
        >>> Block(2, 1, 1, mass=12).inertia.tensor.diagonal()
        array([2., 5., 5.])
        """
        if self.mass is None and self.density is None:
            return None
        volume, centre, (x2, y2, z2) = self._solid()
        mass = self.mass or volume * (self.density or 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # Inertia raises for overflow
            tensor = np.diag(mass * np.array([y2 + z2, x2 + z2, x2 + y2]))
        return Inertia(mass, centre, tensor).at(self.pose)

    @cached_property
    def vertices(self) -> Array:
        """Corner points (V, 3) in the frame that carries the solid, in metres."""
        return make_read_only(self.pose @ self._corners())

    @property
    def edges(self) -> Indices:
        """Edges (E, 2), as pairs of vertex indices."""
        return np.array(sorted({tuple(sorted(e)) for e in self._edges()}))

    @property
    def color(self) -> str:
        """Colour of the lines: a letter as in the chapter, or any colour of Matplotlib."""
        raise NotImplementedError

    @property
    def figure_color(self) -> str:
        """Colour of the solid in figures: its colour, or the mean grey of its picture."""
        return self.color

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices around each face."""
        raise NotImplementedError

    @property
    def skin(self) -> tuple[Array, tuple[Face, ...]]:
        """Points (P, 3) in metres and faces for solid drawings; the points begin with the vertices.

        By default these are the vertices and faces. A solid with a coarse wire frame, such as a
        ball, has additional points.
        """
        return self.vertices, self.faces

    @property
    def hull(self) -> Hull:
        """Convex hull in the frame that carries the solid, or a slightly larger convex body.

        Raises
        ------
        InputError
            If no hull is defined for this type of solid.

        Examples
        --------
        >>> from robsim import Block
        >>> [len(part) for part in Block(1, 2, 3).hull[:3]]
        [8, 3, 3]
        """
        return self._hull().at(self.pose)

    def shown(self) -> tuple[Primitive, ...]:
        """Return the solids that figures draw: the solid itself, or the content of a mesh file."""
        return (self,)

    @property
    def face_pictures(self) -> Mapping[int, FacePicture]:
        """The pictures on faces, by the index of the face; by default none."""
        return {}

    def simpler(self) -> tuple[Primitive, ...]:
        """Return equivalent simpler solids for file formats without this type; by default none."""
        return ()

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        """Return volume, centre of mass, and the mean squares of x, y and z about it."""
        raise NotImplementedError

    def _corners(self) -> Array:
        """Return the vertices (V, 3) in the axes of the solid."""
        raise NotImplementedError

    def _hull(self) -> Hull:
        """Return the hull in the axes of the solid."""
        raise InputError(f"no hull of a {type(self).__name__} is known")

    def _edges(self) -> list[tuple[int, int]]:
        """Return the edges, by default every side of every face."""
        return [(a, b) for f in self.faces for a, b in zip(f, f[1:] + f[:1], strict=True)]
