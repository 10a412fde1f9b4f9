"""Folders that one process at a time writes into."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError

LOCK_FILE = ".robsim-claim"  # the file that says who writes


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Keep other processes from claiming a folder within a `with` block.

    The system holds the lock and lets it go when the process ends, however that comes, so that no
    claim is left behind by a process that was killed. FileError: another process has the folder.
    """
    path = folder / LOCK_FILE
    with convert_os_errors(folder):
        number = _open_locked(path)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(number)


def _open_locked(path: Path) -> int:
    """Return the number of the file, open and locked, with our process number in it."""
    while True:
        number = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock_file(number)
            if _is_file_at(path, number):  # else who had it has just removed it
                os.truncate(number, 0)
                os.write(number, str(os.getpid()).encode())
                return number
        except BlockingIOError:
            who = os.read(number, 20).decode(errors="replace") or "another"
            os.close(number)
            raise FileError(f"{path.parent}: process {who} is writing there") from None
        os.close(number)


def _lock_file(number: int) -> None:
    """Lock an open file where the system can; BlockingIOError: another process has locked it."""
    if sys.platform == "win32":
        return
    import fcntl

    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:  # some network folders know no locks
        if isinstance(error, BlockingIOError):
            raise


def _is_file_at(path: Path, number: int) -> bool:
    """Return whether an open file still has its name."""
    try:
        return os.path.samestat(os.fstat(number), os.stat(path))
    except FileNotFoundError:
        return False
