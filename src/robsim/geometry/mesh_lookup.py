"""Where the mesh that a model's file names lies on disk, if it may lie there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from robsim.base.errors import FileError

PACKAGE_SCHEME, FILE_SCHEME = "package://", "file://"
SEARCH_PATH = "ROS_PACKAGE_PATH"  # the variable that lists folders of packages


def find_mesh_file(name: str, folder: Path) -> Path:
    """Return the path of a mesh that a model's file in `folder` names, links of the disk followed.

    "package://arm/elbow.stl" lies in the folder "arm": one that contains `folder`, stands beside
    one that does, or is on the ROS_PACKAGE_PATH. Other names, with or without "file://", are
    relative to `folder` or absolute. A file outside of its package, and without a package outside
    of the parent of `folder`, is not looked at.

    FileError: there is none, or it lies elsewhere.
    """
    try:
        tried = [_resolve_inside(root, path) for root, path in _list_mesh_candidates(name, folder)]
    except (OSError, ValueError, RuntimeError):  # names that the disk does not take; loops of links
        tried = []
    found = [path for path in tried if path is not None and path.is_file()]
    if found:
        return found[0]
    raise FileError("outside of its package" if tried and None in tried else "not found")


def _list_mesh_candidates(name: str, folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield folders that may hold the file, each with where it would be."""
    if not name.startswith(PACKAGE_SCHEME):
        plain = name.removeprefix(FILE_SCHEME)
        yield folder.parent, folder / plain
        return
    package, _, rest = name.removeprefix(PACKAGE_SCHEME).lstrip("/").partition("/")
    for root in _find_package_folders(package, folder):
        yield root, root / rest


def _find_package_folders(package: str, folder: Path) -> Iterator[Path]:
    """Yield the folders of that name: upwards from `folder`, then on the search path."""
    listed = [Path(part) for part in os.environ.get(SEARCH_PATH, "").split(os.pathsep) if part]
    for above in (folder, *folder.parents, *listed):
        if above.name == package:
            yield above
        if (above / package).is_dir():
            yield above / package


def _resolve_inside(root: Path, path: Path) -> Path | None:
    """Return the path with its links followed, or None if that leads out of the folder."""
    real = path.resolve()
    return real if real.is_relative_to(root.resolve()) else None
