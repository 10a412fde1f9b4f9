"""Lookup of the mesh file that a model file names, within the folders that it may refer to."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from robsim.base.errors import FileError

PACKAGE_SCHEME, FILE_SCHEME = "package://", "file://"
SEARCH_PATH = "ROS_PACKAGE_PATH"  # the variable that lists folders of packages


def find_mesh_file(name: str, folder: Path) -> Path:
    """Return the resolved path of a mesh that a model file in `folder` names.

    "package://arm/elbow.stl" refers to the folder "arm", which is an ancestor of `folder`, a
    sibling of such an ancestor, or in a folder of ROS_PACKAGE_PATH. Other names, with or without
    "file://", are absolute or relative to `folder`. The file must be inside its package, or inside
    the parent of `folder` if it names no package. Symbolic links are followed.

    Raises
    ------
    FileError
        If no such file exists, or the file is outside of the permitted folder.
    """
    try:
        paths = [_resolve_inside(root, path) for root, path in _list_mesh_candidates(name, folder)]
    except (OSError, ValueError, RuntimeError):  # invalid file names; loops of symbolic links
        paths = []
    files = [path for path in paths if path is not None and path.is_file()]
    if files:
        return files[0]
    raise FileError("outside of its package" if paths and None in paths else "not found")


def _list_mesh_candidates(name: str, folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield pairs of a permitted folder and the path that the file would have in it."""
    if not name.startswith(PACKAGE_SCHEME):
        relative = name.removeprefix(FILE_SCHEME)
        yield folder.parent, folder / relative
        return
    package, _, rest = name.removeprefix(PACKAGE_SCHEME).lstrip("/").partition("/")
    for root in _find_package_folders(package, folder):
        yield root, root / rest


def _find_package_folders(package: str, folder: Path) -> Iterator[Path]:
    """Yield the folders named `package`, first at or above `folder`, then on the search path."""
    search_path = [Path(part) for part in os.environ.get(SEARCH_PATH, "").split(os.pathsep) if part]
    for parent in (folder, *folder.parents, *search_path):
        if parent.name == package:
            yield parent
        if (parent / package).is_dir():
            yield parent / package


def _resolve_inside(root: Path, path: Path) -> Path | None:
    """Return the resolved path, or None if it is outside of the folder `root`."""
    real = path.resolve()
    return real if real.is_relative_to(root.resolve()) else None
