"""Reading of whole files with a limit of their size."""

from __future__ import annotations

import os
from pathlib import Path

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError


def read_bytes(path: str | os.PathLike[str], expected: str, largest: int) -> bytes:
    """Return the content of a file of at most `largest` bytes.

    Raise FileError if the file is missing, a folder, too large, or unreadable. `expected` describes
    its content.

    >>> Path("lens.xml").write_text("<lens/>")
    7
    >>> read_bytes("lens.xml", "an XML file", 100)
    b'<lens/>'
    """
    with convert_os_errors(path, "read"):
        if Path(path).is_dir():
            raise FileError(f"{path}: this is a folder; expected {expected}")
        if not Path(path).is_file():
            raise FileError(f"{path}: no such file")
        with open(path, "rb") as file:
            data = file.read(largest + 1)
    if len(data) > largest:
        raise FileError(f"{path}: larger than {largest // 1_000_000} MB")
    return data


def format_relative_path(path: Path, folder: Path) -> str:
    """Return a path relative to a folder that contains it, or else the absolute path.

    >>> format_relative_path(Path("cell/robots/arm.urdf").absolute(), Path("cell"))
    'robots/arm.urdf'
    """
    inside = path.is_relative_to(folder.absolute())
    return path.relative_to(folder.absolute()).as_posix() if inside else path.as_posix()
