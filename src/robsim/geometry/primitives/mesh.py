"""A mesh by its file name, which is opened for figures alone."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, format_value
from robsim.declare import ListOf, Number, Role, Text, register
from robsim.geometry.mesh_files import ColoredMesh, load_mesh
from robsim.geometry.mesh_lookup import FILE_SCHEME, PACKAGE_SCHEME, find_mesh_file
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive
from robsim.geometry.primitives.surface import Surface


@dataclass(frozen=True)
class MeshSource:
    """The folder of the file that named a mesh, and shapes in place of it, in its own axes."""

    folder: Path
    stand_ins: tuple[Primitive, ...] = ()


@register("shape", "mesh")
@dataclass(frozen=True)
class Mesh(Primitive):
    """A mesh by its file name; figures draw it where a URDF file named it and the extra is there.

    `filename` is "package://name/..." or a name relative to the folder of the model's file; it
    may climb one folder, to that of the package, and no further. "file://" may stand before it, and
    before an absolute name. `scale` is along x, y and z. The mass of a mesh is not known: the link
    gives it. `source`, which `Robot.from_urdf` sets, is no part of its value: equality, hashes and
    text forms do not know it, and no result of a run depends on it.

    >>> Mesh("package://arm/meshes/elbow.stl").vertices.shape
    (0, 3)
    """

    pose: Annotated[
        Pose, FLAT_POSE, Role.FILE, "Pose of the mesh in the frame that carries it."
    ] = field(default=IDENTITY, kw_only=True)
    filename: Annotated[str, Text(1000), Role.FILE, "Name of the file of the mesh."]
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
            raise InputError("the inertia of a mesh is not known: give the link's")

    def shown(self) -> tuple[Primitive, ...]:
        """Return the surfaces of its file, each in its colour, or what stands for it.

        A colour of its own comes before those of the file, unless it is black.
        """
        found = self._found()
        if isinstance(found, tuple):
            return tuple(self._surface(piece) for piece in found)
        stand_ins = self.source.stand_ins if self.source else ()
        return tuple(replace(each, color=self.color).at(self.pose) for each in stand_ins)  # type: ignore[call-arg]

    @property
    def lack(self) -> str | None:
        """Why its file is not drawn, in words, or None: it is, or is not to be."""
        found = self._found()
        return f"{format_value(self.filename)}: {found}" if isinstance(found, FileError) else None

    def _found(self) -> tuple[ColoredMesh, ...] | FileError:
        """Return what its file holds, if it is to be drawn, or what is wrong with it."""
        if self.source is None:
            return ()
        try:
            return load_mesh(find_mesh_file(self.filename, self.source.folder))
        except FileError as error:
            return error

    def _surface(self, piece: ColoredMesh) -> Surface:
        scale = np.array(self.scale)
        turned = piece.triangles[:, ::-1] if scale.prod() < 0 else piece.triangles  # still outwards
        color = piece.color if self.color == "k" and piece.color else self.color
        return Surface(piece.points * scale, turned, piece.sharp, color, pose=self.pose)

    @property
    def edges(self) -> Array:
        """The edges (0, 2): it has none, but what it shows may have."""
        return np.empty((0, 2), dtype=np.int64)

    @property
    def faces(self) -> tuple[Face, ...]:
        """The faces: it has none, but what it shows has."""
        return ()

    def _corners(self) -> Array:
        return np.empty((0, 3))


def _check_mesh_name(name: object) -> None:
    """Raise InputError unless the name stays within its package, or that of the model."""
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
