"""Files that appear under their names only when they are complete."""

from __future__ import annotations

import os
import re
import time
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from robsim.base.errors import FileError, format_value

_DRAFT = re.compile(r"\.robsim-(\d+)-[0-9a-f]{32}")
ABANDONED = 86400.0  # seconds until a draft is deleted even if its process number is in use


def write_whole(path: str | os.PathLike[str], content: bytes | memoryview | str) -> Path:
    """Write a file and missing folders; an old file is replaced at the end of the writing.

    Raise FileError if the file cannot be written, for example on a full disk. The old file is then
    unchanged.

    >>> write_whole("notes/gain.txt", "gain 2").read_text()
    'gain 2'
    """
    with convert_os_errors(path):
        if not Path(path).name or Path(path).is_dir():
            raise IsADirectoryError("it is a folder")
        target = Path(os.path.realpath(path))  # keep a symbolic link
        data = content.encode() if isinstance(content, str) else content
        if target.exists() and not target.is_file():  # a device or a pipe, such as /dev/stdout
            target.write_bytes(data)
            return Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_drafts(target.parent)
        draft = make_draft_path(target)
        try:
            _write_synced(draft, data)
            draft.replace(target)
        finally:
            draft.unlink(missing_ok=True)
        _sync_folder(target.parent)
    return Path(path)


def check_suffix(path: object, suffixes: Sequence[str], kind: str) -> None:
    """Raise FileError if a file name has a suffix other than these; names without one are valid.

    >>> check_suffix("run.csv", [".nc"], "a run")
    Traceback (most recent call last):
    robsim.base.errors.FileError: run.csv: expected a name that ends in .nc for a run
    """
    if isinstance(path, str | os.PathLike) and Path(path).suffix.lower() not in ("", *suffixes):
        raise FileError(f"{path}: expected a name that ends in {' or '.join(suffixes)} for {kind}")


def make_draft_path(target: Path) -> Path:
    """Return the path of a draft, which contains the process number, for later renaming."""
    return target.parent / f".robsim-{os.getpid()}-{uuid.uuid4().hex}"


@contextmanager
def convert_os_errors(path: object, doing: str = "write") -> Iterator[None]:
    """Convert errors of the system to a FileError that names the path."""
    try:
        yield
    except FileError:
        raise
    except (OSError, TypeError, ValueError) as error:  # ValueError: paths with a NUL
        reason = getattr(error, "strerror", None) or error
        name = str(path) if isinstance(path, str | os.PathLike) else format_value(path)
        raise FileError(f"cannot {doing} {name:.300}: {reason}") from None


def _remove_drafts(folder: Path) -> None:
    """Delete the drafts of processes that were killed while they wrote into a folder."""
    for path in folder.glob(".robsim-*"):
        match = _DRAFT.fullmatch(path.name)
        if match and int(match[1]) != os.getpid():
            with suppress(OSError):
                old = time.time() - path.stat().st_mtime > ABANDONED
                if old or not _is_process_alive(int(match[1])):
                    path.unlink()


def _is_process_alive(process: int) -> bool:
    """Return whether a process with this number is running on this machine."""
    if os.name == "nt":  # signal 0 would end the process
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def _write_synced(path: Path, content: bytes | memoryview) -> None:
    with open(path, "xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync_folder(folder: Path) -> None:
    """Flush the directory entry to disk, if the system can."""
    with suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
