"""Reading of regular files with a limit of their size.

Every function that reads a file of the user opens it here. A device such as /dev/zero never ends,
and a pipe waits for its writer, so that neither is opened.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError

_KINDS = {stat.S_IFDIR: "folder", stat.S_IFIFO: "pipe", stat.S_IFSOCK: "socket"}


def read_bytes(path: str | os.PathLike[str], expected: str, largest: int) -> bytes:
    """Return the content of a regular file of at most `largest` bytes.

    Raise FileError if the file is missing, not a regular file, too large, or unreadable. `expected`
    describes its content.

    >>> Path("lens.xml").write_text("<lens/>")
    7
    >>> read_bytes("lens.xml", "an XML file", 100)
    b'<lens/>'
    """
    with convert_os_errors(path, "read"), open_regular_file(path, expected) as file:
        data = file.read(largest + 1) or b""  # None from a file of /proc that would wait
    if len(data) > largest:
        raise FileError(f"{path}: larger than {largest // 1_000_000} MB")
    return data


def open_regular_file(path: str | os.PathLike[str], expected: str) -> BinaryIO:
    """Return a regular file, opened for reading; raise FileError for a path of another kind.

    >>> open_regular_file("/dev/zero", "a TOML file")
    Traceback (most recent call last):
    robsim.base.errors.FileError: /dev/zero: this is a device; expected a TOML file
    """
    check_regular_file(path, expected)
    with convert_os_errors(path, "read"):
        file = open(path, "rb", opener=_open_without_waiting)  # noqa: SIM115  the caller closes it
        try:
            _check_kind(path, os.fstat(file.fileno()), expected)  # it may have been replaced
        except FileError:
            file.close()
            raise
    return file


def check_regular_file(path: str | os.PathLike[str], expected: str) -> None:
    """Raise FileError unless a path leads to a regular file, without opening it.

    Use it in front of a library that opens files by their paths.

    >>> check_regular_file("nothing.mcap", "a bag")
    Traceback (most recent call last):
    robsim.base.errors.FileError: nothing.mcap: no such file
    """
    with convert_os_errors(path, "read"):
        try:
            found = Path(path).stat()
        except (FileNotFoundError, NotADirectoryError):
            raise FileError(f"{path}: no such file") from None
        _check_kind(path, found, expected)


def _check_kind(path: str | os.PathLike[str], found: os.stat_result, expected: str) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "device")
        raise FileError(f"{path}: this is a {kind}; expected {expected}")


def _open_without_waiting(path: str, flags: int) -> int:
    """Open a file; a pipe that took the place of a regular file does not wait for a writer."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
