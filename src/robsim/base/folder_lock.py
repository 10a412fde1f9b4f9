"""Locks of folders, for one writing process at a time."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError

LOCK_FILE = ".robsim-claim"  # the lock file, with the number of the writing process


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Lock a folder for other processes within a `with` block.

    The system holds the lock and releases it at the end of the process, even if the process is
    killed. Raise FileError if another process holds the lock.
    """
    path = folder / LOCK_FILE
    with convert_os_errors(folder):
        number = _open_locked(path)
    try:
        yield
    finally:
        _remove_lock(path, number)


def _open_locked(path: Path) -> int:
    """Return the descriptor of the open and locked file, with our process number in it."""
    while True:
        number = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock_file(number)
            if _is_file_at(path, number):  # else the previous owner has just removed it
                os.truncate(number, 0)
                os.write(number, str(os.getpid()).encode())
                return number
        except BlockingIOError:
            owner = os.read(number, 20).decode(errors="replace") or "another"
            os.close(number)
            raise FileError(f"{path.parent}: process {owner} is writing there") from None
        os.close(number)


def _remove_lock(path: Path, number: int) -> None:
    """Delete the lock file and close it; Windows deletes no open file, and has no lock to keep."""
    if os.name == "nt":
        os.close(number)
        with suppress(OSError):
            path.unlink()
    else:
        path.unlink(missing_ok=True)
        os.close(number)


def _lock_file(number: int) -> None:
    """Lock an open file if the system can; BlockingIOError if another process has locked it."""
    if sys.platform == "win32":
        return
    import fcntl

    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:  # some network folders have no locks
        if isinstance(error, BlockingIOError):
            raise


def _is_file_at(path: Path, number: int) -> bool:
    """Return whether an open file still exists under its path."""
    try:
        return os.path.samestat(os.fstat(number), os.stat(path))
    except FileNotFoundError:
        return False
