"""Mesh by the name of its file, which is opened for figures only."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, format_value
from robsim.declare import ListOf, Number, Role, Text, register
from robsim.geometry.mesh_files import load_mesh
from robsim.geometry.mesh_lookup import FILE_SCHEME, PACKAGE_SCHEME, find_mesh_file
from robsim.geometry.mesh_parser import ColoredMesh, Indices
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive
from robsim.geometry.primitives.surface import Surface


@dataclass(frozen=True)
class MeshSource:
    """Folder of the model file that names a mesh, and substitutes for the mesh.

    Attributes
    ----------
    folder : Path
        Folder of the model file.
    stand_ins : tuple of Primitive
        Collision shapes in the axes of the mesh. Figures draw them if the mesh file cannot be read.
    """

    folder: Path
    stand_ins: tuple[Primitive, ...] = ()


@register("shape", "mesh")
@dataclass(frozen=True)
class Mesh(Primitive):
    """Mesh by its file name, for figures.

    Figures draw the mesh if it comes from a URDF file and the extra `mesh` is installed. The file
    name is "package://name/..." or relative to the folder of the model file; it may lead out of
    this folder by one level at most. An absolute name needs the prefix "file://". The mass of a
    mesh is unknown, so its link must give the inertia. `Robot.from_urdf` sets `source`, which has
    no effect on equality, hashes, text forms and results of runs.

    Raises
    ------
    InputError
        If the file name leaves its package, a scale is zero, or a mass or density is given.

    Examples
    --------
    >>> Mesh("package://arm/meshes/elbow.stl").vertices.shape
    (0, 3)
    """

    pose: Annotated[
        Pose, FLAT_POSE, Role.FILE, "Pose of the mesh in the frame that carries it."
    ] = field(default=IDENTITY, kw_only=True)
    filename: Annotated[str, Text(1000), Role.FILE, "Name of the mesh file."]
    scale: Annotated[
        tuple[float, float, float], ListOf(Number(), 3, 3), Role.FILE, "Scale along x, y and z."
    ] = (1.0, 1.0, 1.0)
    color: FigureColour = "k"
    mass: None = field(default=None, kw_only=True)
    density: None = field(default=None, kw_only=True)
    source: MeshSource | None = field(default=None, kw_only=True, compare=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_mesh_name(self.filename)
        if not all(self.scale):
            raise InputError(f"Mesh.scale must be three numbers other than 0, got {self.scale}")
        if self.mass is not None or self.density is not None:
            raise InputError("the inertia of a mesh is not known: give the inertia of its link")

    def shown(self) -> tuple[Primitive, ...]:
        """Return the surfaces of the mesh file, or its substitute shapes.

        Each surface has the colour in the file, unless the mesh has a colour other than black.
        """
        content = self._load()
        if isinstance(content, tuple):
            return tuple(self._make_surface(piece) for piece in content)
        stand_ins = self.source.stand_ins if self.source else ()
        return tuple(replace(each, color=self.color).at(self.pose) for each in stand_ins)  # type: ignore[call-arg]

    @property
    def lack(self) -> str | None:
        """Reason why the mesh file cannot be drawn, or None if it can or no source is known."""
        content = self._load()
        return (
            f"{format_value(self.filename)}: {content}" if isinstance(content, FileError) else None
        )

    def _load(self) -> tuple[ColoredMesh, ...] | FileError:
        """Return the parts of the mesh file, none if no source is known, or the error."""
        if self.source is None:
            return ()
        try:
            return load_mesh(find_mesh_file(self.filename, self.source.folder))
        except FileError as error:
            return error

    def _make_surface(self, piece: ColoredMesh) -> Surface:
        """Return a part of the mesh as a surface, scaled and with faces turned outwards."""
        scale = np.array(self.scale)
        triangles = piece.triangles[:, ::-1] if scale.prod() < 0 else piece.triangles  # outwards
        color = piece.color if self.color == "k" and piece.color else self.color
        return Surface(piece.points * scale, triangles, piece.sharp, color, pose=self.pose)

    @property
    def edges(self) -> Indices:
        """Edges (0, 2): a mesh has none; the surfaces of `shown` have edges."""
        return np.empty((0, 2), dtype=np.int64)

    @property
    def faces(self) -> tuple[Face, ...]:
        """Faces: a mesh has none; the surfaces of `shown` have faces."""
        return ()

    def _corners(self) -> Array:
        return np.empty((0, 3))


def _check_mesh_name(name: object) -> None:
    """Raise InputError unless the name stays within its package, or the package of the model."""
    good = 'expected "package://name/..." or a name relative to the folder of the file'
    if not isinstance(name, str) or not 0 < len(name) <= 1000 or not name.isprintable():
        raise InputError(f"mesh {format_value(name)}: {good}")
    package, file = name.startswith(PACKAGE_SCHEME), name.startswith(FILE_SCHEME)
    bare = (
        name.removeprefix(PACKAGE_SCHEME).lstrip("/") if package else name.removeprefix(FILE_SCHEME)
    )
    path = PurePosixPath(bare)
    parts = path.parts[path.is_absolute() :]
    astray = (path.is_absolute() and not file) or "\\" in name or ":" in bare
    if astray or len(parts) < 1 + package:
        raise InputError(f"mesh {format_value(name)}: absolute, or not a file name; {good}")
    depth = -1 if package else 1  # the first part names the package
    for part in parts:
        depth += -1 if part == ".." else 1
        if depth < 0:
            raise InputError(f"mesh {format_value(name)}: leaves its package by '..'; {good}")
