"""Contents of meshes in texts: the SHA-256 of the triangles, or the file by its name only.

A scenario file names the file of a mesh, `filename = "stone.stl"`, relative to its folder. The
complete text of a run adds the SHA-256 of the triangles. The data itself is stored with the run,
and beside a scenario file or a study in the folder `meshes`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from robsim.base.errors import FileError, InputError, format_value, suggest_names
from robsim.base.file_content import read_bytes
from robsim.declare.context import MISSING, Context, FieldValue, Raw
from robsim.declare.spec import Spec, make_expected_error
from robsim.geometry.content_reference import (
    DIGEST_KEY,
    DIGEST_SCHEMA,
    check_content,
    check_digest_text,
    find_stored,
    make_missing_error,
    refer_to_content,
)
from robsim.geometry.primitives.mesh_file import MeshFile
from robsim.geometry.triangle_mesh import TriangleMesh

FOLDER = "meshes"  # beside a text, with the meshes that it names by their SHA-256
LARGEST_FILE = 50_000_000  # bytes
NAME_FIELD = "filename"  # of the table
REFERENCE_SCHEMA = {
    "type": "object",
    "properties": {DIGEST_KEY: DIGEST_SCHEMA},
    "additionalProperties": False,
    "required": [DIGEST_KEY],
}


class MeshSpec(Spec):
    """A field with the triangles of a mesh, which its file has by default.

    Examples
    --------
    >>> import numpy as np
    >>> MESH.check((np.eye(3), [[0, 1, 2]]), "content")
    TriangleMesh(1 triangles, 640b825e4af6)
    """

    phrase: ClassVar[str] = 'the SHA-256 of triangles, as in { sha256 = "..." }'
    python_phrase: ClassVar[str] = "a TriangleMesh, or a pair of points and triangles"
    json: ClassVar[Mapping[str, Any]] = REFERENCE_SCHEMA

    def check(self, value: object, what: str) -> FieldValue:
        return _open_mesh(value, f"{what}: expected {self.accepts()}")

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> FieldValue:
        return super().pick(table, name, c) if name in table else _find_file(table, c)

    def read(self, raw: Raw, c: Context) -> FieldValue:
        return _read_mesh(raw, c)

    def put(self, table: dict[str, Raw], name: str, value: object, c: Context) -> None:
        if (mesh := _find_written_mesh(value, c)) is not None:
            table[name] = refer_to_content(mesh, c)


MESH = MeshSpec()


def _open_mesh(value: Any, expected: str) -> MeshFile | TriangleMesh:
    """Return a content of a mesh: itself, or the mesh of two arrays."""
    if isinstance(value, tuple | list) and len(value) == 2:
        return TriangleMesh.from_arrays(*value)
    if not isinstance(value, MeshFile | TriangleMesh):
        raise InputError(f"{expected}, got {format_value(value)}")
    return value


def _find_file(table: Mapping[str, Raw], c: Context) -> FieldValue:
    """Return the file that the text of a file names; MISSING if the text is of no file."""
    name = c.facts["own"].get(NAME_FIELD) if NAME_FIELD in table else None
    is_file = c.facts.get("text_file", False)
    return MeshFile(name, Path(c.facts["folder"]).absolute()) if name and is_file else MISSING


def _read_mesh(raw: Raw, c: Context) -> TriangleMesh:
    """Return the mesh of a text; raise InputError if it cannot be found."""
    if not isinstance(raw, Mapping) or not raw:
        raise make_expected_error(MeshSpec.phrase, raw)
    for key, value in raw.items():
        if key != DIGEST_KEY:
            suggestion = suggest_names(key, (DIGEST_KEY,), "keys")
            raise InputError(f"unknown key {format_value(key)}; {suggestion}")
        check_digest_text(value)
    try:
        return _find_mesh(raw[DIGEST_KEY], c)
    except FileError as error:  # one problem among others of the text
        raise InputError(str(error)) from None


def _find_mesh(digest: str, c: Context) -> TriangleMesh:
    """Return the mesh of a digest among the stored ones, or of a file; raise FileError.

    The text of a run opens no file: its meshes are stored with the run.
    """
    stored: TriangleMesh | None = find_stored(digest, c, TriangleMesh)
    if stored is not None:
        return stored
    folder = Path(c.facts.get("folder", ""))
    path = get_mesh_path(folder, digest)
    if not c.facts.get("text_file", False):
        raise make_missing_error(digest, path, "mesh")
    if path.exists():
        mesh = TriangleMesh.unpack(read_bytes(path, "a mesh", LARGEST_FILE), str(path))
    else:
        file = MeshFile(c.facts["own"].get(NAME_FIELD, ""), folder)
        try:
            path = file.path
        except FileError:
            raise make_missing_error(digest, path, "mesh") from None
        mesh = _load(file)
    check_content(mesh, digest, path, "mesh")
    return mesh


def _load(file: MeshFile) -> TriangleMesh:
    """Return the triangles of a file; raise FileError with its name."""
    try:
        return file.load()
    except FileError as error:
        raise FileError(f"{file.name}: {error}") from None


def _find_written_mesh(value: object, c: Context) -> TriangleMesh | None:
    """Return the mesh whose SHA-256 a text names; None if the name of its file is enough."""
    if not isinstance(value, MeshFile):
        return value if isinstance(value, TriangleMesh) else None
    try:
        if "read_origin" in c.facts and _is_found_from(value, c.facts["folder"]):
            return None
        return value.load()
    except FileError:
        return None


def _is_found_from(file: MeshFile, folder: Path) -> bool:
    """Return whether a text in a folder finds a file by its name, unless the file has changed."""
    here = MeshFile(file.name, Path(folder).absolute())
    try:
        return here.path == file.path and here.digest == file.digest
    except FileError:
        return False


def get_mesh_path(folder: Path, digest: str) -> Path:
    """Return the path of a mesh that a text in a folder names by its SHA-256.

    >>> get_mesh_path(Path("cell"), 64 * "a").as_posix()
    'cell/meshes/aaaaaaaaaaaaaaaa.mesh'
    """
    return folder / FOLDER / f"{digest[:16]}.mesh"
