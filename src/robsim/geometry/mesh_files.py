"""Surfaces of mesh files for figures, from a cache or from the process that reads them."""

from __future__ import annotations

from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from robsim.base.errors import FileError
from robsim.geometry.mesh_parser import LARGEST_FILE, ColoredMesh
from robsim.geometry.mesh_process import MESH_PROCESS

SUFFIXES = (".stl", ".obj", ".dae", ".glb")
CACHED_MESHES = 128  # largest number of meshes in memory
LIBRARIES = ("trimesh", "fast_simplification")


def load_mesh(path: Path) -> tuple[ColoredMesh, ...]:
    """Return the simplified triangles of a mesh file, grouped by colour.

    Raises
    ------
    FileError
        If the file cannot be read, is too large, or is not a mesh, if it needs too much time or
        memory, or if the extra is not installed.
    """
    try:
        stat = path.stat()
    except OSError as error:
        raise FileError(f"cannot be read: {error.strerror}") from None
    if path.suffix.lower() not in SUFFIXES:
        raise FileError(f"no format of {', '.join(SUFFIXES)}")
    if stat.st_size > LARGEST_FILE:
        raise FileError(f"larger than {LARGEST_FILE // 1_000_000} MB")
    result = _read_mesh_file(path, stat.st_mtime_ns, stat.st_size)
    if isinstance(result, str):
        raise FileError(result)
    return result


@lru_cache(CACHED_MESHES)
def _read_mesh_file(path: Path, changed: int, size: int) -> tuple[ColoredMesh, ...] | str:
    """Return the coloured parts of a file, or an error message.

    The arguments `changed` and `size` make the cache notice a new version of the file.
    """
    if not all(map(find_spec, LIBRARIES)):
        return "trimesh is not installed: pip install 'robsim[mesh]'"
    try:
        return MESH_PROCESS.read(path, size)
    except FileError as error:
        return str(error)
