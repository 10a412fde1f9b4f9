"""Mesh by the name of its file, or with its triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, format_value
from robsim.declare import ListOf, Number, Role, Text, register
from robsim.geometry.mesh_lookup import FILE_SCHEME, PACKAGE_SCHEME
from robsim.geometry.mesh_parser import ColoredMesh, Indices
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives.mesh_file import MeshFile
from robsim.geometry.primitives.mesh_spec import MESH
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive
from robsim.geometry.primitives.surface import Surface
from robsim.geometry.triangle_mesh import TriangleMesh


@register("shape", "mesh")
@dataclass(frozen=True)
class Mesh(Primitive):
    """Mesh by its file name, or with its triangles, for figures and pictures.

    A mesh of a URDF file or of a scenario file is read when it is drawn or stored with a run, if
    the extra `mesh` is installed. The file name is "package://name/..." or relative to the folder
    of that file; it may lead out of this folder by one level at most. An absolute name needs the
    prefix "file://". In Python, `content` is a `TriangleMesh`, or a pair of points (P, 3) in metres
    and triangles (F, 3), and the name is a label. Meshes are equal if their fields and their
    triangles are. A run stores the triangles, so that it can be repeated without the file. The mass
    of a mesh is unknown, so its link must give the inertia.

    Raises
    ------
    InputError
        If the file name leaves its package, a scale is zero, or a mass or density is given.
        If the triangles are not the triangles of a mesh.

    Examples
    --------
    >>> Mesh("package://arm/meshes/elbow.stl").vertices.shape
    (0, 3)
    >>> corner = Mesh("corner.stl", content=(np.eye(3), [[0, 1, 2]]))
    >>> [surface.faces for surface in corner.shown()]
    [((0, 1, 2),)]
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
    content: Annotated[
        MeshFile | TriangleMesh | None, MESH, Role.FIGURE, "Triangles, by default of the file."
    ] = field(default=None, kw_only=True, hash=False, repr=False)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            filename: str,
            scale: Sequence[float] = (1.0, 1.0, 1.0),
            color: str = "k",
            *,
            pose: Pose = IDENTITY,
            mass: None = None,
            density: None = None,
            albedo: float = 0.6,
            content: MeshFile | TriangleMesh | tuple[ArrayLike, ArrayLike] | None = None,
        ) -> None: ...

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
        if isinstance(content, TriangleMesh):
            return tuple(self._make_surface(piece) for piece in content.parts)
        stand_ins = self.content.stand_ins if isinstance(self.content, MeshFile) else ()
        return tuple(replace(each, color=self.color).at(self.pose) for each in stand_ins)  # type: ignore[call-arg]

    @property
    def lack(self) -> str | None:
        """Reason why the mesh cannot be drawn, or None if it can or has no content."""
        content = self._load()
        return (
            f"{format_value(self.filename)}: {content}" if isinstance(content, FileError) else None
        )

    def _load(self) -> TriangleMesh | FileError | None:
        """Return the triangles, None if there is no content, or the error of its file."""
        if not isinstance(self.content, MeshFile):
            return self.content
        try:
            return self.content.load()
        except FileError as error:
            return error

    def _make_surface(self, piece: ColoredMesh) -> Surface:
        """Return a part of the mesh as a surface, scaled and with faces turned outwards."""
        scale = np.array(self.scale)
        triangles = piece.triangles[:, ::-1] if scale.prod() < 0 else piece.triangles  # outwards
        color = piece.color if self.color == "k" and piece.color else self.color
        return Surface(
            piece.points.astype(float) * scale, triangles, piece.sharp, color, pose=self.pose
        )

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
