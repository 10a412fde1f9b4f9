"""File of a mesh, which is read when the mesh is drawn or stored."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from robsim.base.errors import FileError
from robsim.geometry.mesh_files import load_mesh
from robsim.geometry.mesh_lookup import find_mesh_file
from robsim.geometry.primitives.primitive import Primitive
from robsim.geometry.triangle_mesh import TriangleMesh


@dataclass(frozen=True, eq=False)
class MeshFile:
    """File of a mesh, and substitutes for the mesh.

    The triangles that were read first are kept: a file that changes later does not change the
    mesh. Two files are equal if they have the same triangles.

    Attributes
    ----------
    name : str
        Name of the file in the text that refers to it.
    folder : Path
        Folder of that text.
    stand_ins : tuple of Primitive
        Collision shapes in the axes of the mesh. Figures draw them if the file cannot be read.
    """

    name: str
    folder: Path
    stand_ins: tuple[Primitive, ...] = ()

    def load(self) -> TriangleMesh:
        """Return the simplified triangles of the file; raise FileError if it cannot be read."""
        return self._triangles

    @property
    def path(self) -> Path:
        """The resolved path of the file; FileError if the file does not exist."""
        return find_mesh_file(self.name, self.folder)

    @property
    def digest(self) -> str | None:
        """The SHA-256 of the triangles, or None if the file cannot be read."""
        try:
            return self.load().digest
        except FileError:
            return None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for another process, with the triangles: it may lack the file."""
        with suppress(FileError):
            self.load()
        return dict(vars(self))

    @property
    def _place(self) -> tuple[str, Path] | None:
        """The name and the folder of a file that was not read yet; None afterwards."""
        return None if "_triangles" in vars(self) else (self.name, self.folder)

    @cached_property
    def _triangles(self) -> TriangleMesh:
        return TriangleMesh(load_mesh(self.path))

    def __eq__(self, other: object) -> bool:
        """Return whether the other content, None included, has the same triangles."""
        if isinstance(other, MeshFile) and self._place == other._place is not None:
            return True  # both would read the same file
        return self.digest == getattr(other, "digest", None)

    def __hash__(self) -> int:
        return hash(self.name)
